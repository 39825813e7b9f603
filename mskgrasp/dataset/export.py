"""Export of datasets as one plain .npz file."""

from __future__ import annotations

import json
import shutil
import uuid
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset.attempts import COLUMNS, ShardInfo
from mskgrasp.dataset.shards import SCHEMA_VERSION, list_shards, read_columns

Watch = Callable[[Sequence[Path]], Iterable[Path]]
"""Yields each of the files that will be read; may show a progress bar."""
SMALL = tuple(name for name in COLUMNS if name != "depth")
_SHARED = (
    "region", "table_z", "intrinsics", "T_base_camera", "physics", "noise", "fidelity", "hand", "planner",
)  # fmt: skip


def check_export_path(folder: Path, path: Path, suffix: str) -> list[Path]:
    """List the files that an export of the dataset in ``folder`` will write.

    Raises:
        UsageError: The name has another suffix, a file exists, it is among the shards, or its folder cannot
            be made.
    """
    if path.resolve().is_relative_to((folder / "shards").resolve()):
        raise UsageError(f"--out {path} lies among the dataset's shards; choose another folder")
    if path.suffix != suffix:
        raise UsageError(f"--out {path}: this format needs a name that ends in {suffix}")
    files = [path, path.with_suffix(".json")] if suffix == ".h5" else [path]
    for file in files:
        if file.exists():
            raise UsageError(
                f"--out: {file} exists, and is not overwritten; choose another name or delete it"
            )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"cannot make folder {path.parent}: {error.strerror}; choose another --out"
        ) from error
    return files


def export_npz(folder: Path, out: Path, watch: Watch = iter) -> int:
    """Write all attempts of a dataset into one .npz file that numpy reads without pickle.

    The arrays of the shards are joined in the order of the shards' names; docs/dataset.md has the layout.
    Only the images of one shard are in memory at a time.

    Returns:
        The number of attempts.

    Raises:
        BadDataset: A shard is damaged, or the shards do not belong together.
        UsageError: The file exists, or cannot be made.
    """
    check_export_path(folder, out, ".npz")
    paths = list_shards(folder)
    pieces: dict[str, list[np.ndarray]] = {name: [] for name in SMALL}
    infos: list[ShardInfo] = []
    for path in paths:
        columns, info = read_columns(path, SMALL)
        same_settings(path, info, infos[:1])
        infos.append(info)
        for name in SMALL:
            pieces[name].append(columns[name])
    counts = [len(grasps) for grasps in pieces["grasp"]]
    with renamed_at_the_end(out.parent, [out]) as temporary:
        with zipfile.ZipFile(temporary / out.name, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
            for name, array in _about(infos, counts).items():
                _add(file, name, array.dtype, array.shape, [array])
            for name in SMALL:
                joined = np.concatenate(pieces[name])
                _add(file, name, joined.dtype, joined.shape, [joined])
            first = read_columns(paths[0], ("depth",))[0]["depth"]
            shape = (sum(counts), *first.shape[1:])
            images = _images(watch(paths), dict(zip(paths, counts, strict=True)), shape[1:])
            _add(file, "depth", first.dtype, shape, images)
    return sum(counts)


def _images(paths: Iterable[Path], counts: dict[Path, int], size: tuple[int, ...]) -> Iterator[np.ndarray]:
    for path in paths:
        depth = read_columns(path, ("depth",))[0]["depth"]
        if depth.shape != (counts[path], *size):
            raise BadDataset(
                f"{path}: depth has shape {depth.shape}, must be {(counts[path], *size)}; "
                f"see: python -m mskgrasp.dataset check {path.parent.parent}"
            )
        yield depth


def _about(infos: list[ShardInfo], counts: list[int]) -> dict[str, np.ndarray]:
    """Make the arrays of an .npz that are not columns of shards."""
    parts = parts_of(infos)
    names, info = sorted(parts), infos[0]
    return dict(
        schema_version=np.array(SCHEMA_VERSION),
        part=np.repeat([names.index(each.part) for each in infos], counts).astype(np.int32),
        shard=np.repeat([each.index for each in infos], counts).astype(np.int32),
        part_names=np.array(names),
        part_families=np.array([parts[name].family for name in names]),
        part_hashes=np.array([parts[name].hash for name in names]),
        failure_names=np.array(FAILURES),
        intrinsics=np.asarray(info.intrinsics),
        T_base_camera=np.asarray(info.T_base_camera.as_vector()),
        table_z=np.array(info.table_z),
        region=np.array(info.region),
        physics_json=np.array(json.dumps(info.physics, sort_keys=True)),
        noise_json=np.array(json.dumps(info.noise, sort_keys=True)),
        planner=np.array(info.planner),
        units_json=np.array(json.dumps({name: f"{c.unit}; frame: {c.frame}" for name, c in COLUMNS.items()})),
    )


def _add(
    file: zipfile.ZipFile, name: str, dtype: np.dtype, shape: tuple[int, ...], pieces: Iterable[np.ndarray]
) -> None:
    header: dict[str, Any] = dict(descr=np.lib.format.dtype_to_descr(dtype), fortran_order=False, shape=shape)
    with file.open(f"{name}.npy", "w", force_zip64=True) as member:
        np.lib.format.write_array_header_2_0(member, header)  # type: ignore[arg-type]
        for piece in pieces:
            member.write(np.ascontiguousarray(piece).tobytes())


@dataclass(frozen=True, kw_only=True)
class _Part:
    hash: str
    family: str


def parts_of(infos: list[ShardInfo]) -> dict[str, _Part]:
    """Collect content hash and family of every part, by name."""
    parts: dict[str, _Part] = {}
    for info in infos:
        own = _Part(hash=info.part_hash, family=info.family)
        if parts.setdefault(info.part, own) != own:
            raise BadDataset(f"part '{info.part}' changed while it was collected; check the dataset")
    return parts


def same_settings(path: Path, info: ShardInfo, first: Sequence[ShardInfo]) -> None:
    """Check that a shard was made with the settings of the first.

    Raises:
        BadDataset: It was not.
    """
    for other in first:
        for name in _SHARED:
            one, two = (_comparable(getattr(each, name)) for each in (info, other))
            if one != two:
                raise BadDataset(
                    f"{path}: {name} differs from the other shards'; "
                    f"see: python -m mskgrasp.dataset check {path.parent.parent}"
                )


def _comparable(value: Any) -> Any:
    value = value.as_vector() if isinstance(value, Pose) else value
    return value.tolist() if isinstance(value, np.ndarray) else value


class renamed_at_the_end:
    """Temporary folder whose files are moved beside it when all of them are written."""

    def __init__(self, folder: Path, files: list[Path]):
        self._folder = folder / f".export-{uuid.uuid4().hex[:12]}.tmp"
        self._files = files

    def __enter__(self) -> Path:
        self._folder.mkdir()
        return self._folder

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                for file in reversed(self._files):
                    (self._folder / file.name).rename(file)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)
