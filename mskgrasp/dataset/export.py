"""Datasets for other tools: one plain .npz file, or ManiSkill's trajectory format."""

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

from mskgrasp.dataset.attempts import COLUMNS, Attempts, ShardInfo, u16_to_depth
from mskgrasp.dataset.shards import SCHEMA_VERSION, list_shards, read_columns, read_shard
from mskgrasp.errors import BadDataset, UsageError
from mskgrasp.geometry import Pose
from mskgrasp.grasp import FAILURES, pose_base_tcp

Watch = Callable[[Sequence[Path]], Iterable[Path]]
"""Given the files that will be read, yields each: the place for a progress bar."""
SMALL = tuple(name for name in COLUMNS if name != "depth")
_SHARED = ("region", "table_z", "intrinsics", "T_base_camera", "physics", "noise")


@dataclass(frozen=True, kw_only=True)
class _Part:
    hash: str
    family: str


def check_export_path(folder: Path, path: Path, suffix: str) -> list[Path]:
    """The files that an export of the dataset in ``folder`` will write.

    Raises:
        UsageError: The name has another ending, a file is there already, it lies among the shards, or its
            folder cannot be made.
    """
    if path.resolve().is_relative_to((folder / "shards").resolve()):
        raise UsageError(f"--out {path} lies among the dataset's shards; choose another folder")
    if path.suffix != suffix:
        raise UsageError(f"--out {path}: this format needs a name that ends in {suffix}")
    files = [path] if suffix == ".npz" else [path, path.with_suffix(".json")]
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
    """Writes all attempts of a dataset into one .npz file that numpy reads without pickle.

    The arrays of the shards are joined in the order of the shards' names; docs/dataset.md has the layout.
    Images pass through memory a shard at a time.

    Returns:
        How many attempts were written.

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
        _same_settings(path, info, infos[:1])
        infos.append(info)
        for name in SMALL:
            pieces[name].append(columns[name])
    counts = [len(grasps) for grasps in pieces["grasp"]]
    with _renamed_at_the_end(out.parent, [out]) as temporary:
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
    """The arrays of an .npz that are not columns of shards."""
    parts = _parts(infos)
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


def export_maniskill(folder: Path, out: Path, watch: Watch = iter) -> int:
    """Writes a dataset as ManiSkill trajectories: ``out`` (.h5) and the .json file beside it.

    An attempt is a trajectory of one step in control mode ``grasp`` of GraspDisplacement-v1; docs/dataset.md
    has the mapping. The part's pose afterwards is known of successes alone: they hang in the lifted hand.

    Returns:
        How many attempts were written.

    Raises:
        BadDataset: A shard is damaged, or the shards do not belong together.
        UsageError: A file exists, or cannot be made.
    """
    # The simulator's own conventions are its room's; this verb alone looks there.
    from tasks.trajectories import Episode, write_trajectories

    files = check_export_path(folder, out, ".h5")
    paths = list_shards(folder)
    _, info = read_columns(paths[0], ("success",))
    size = read_columns(paths[0], ("depth",))[0]["depth"].shape[1:]

    lift_height = info.physics.get("lift_height")
    if not isinstance(lift_height, int | float):
        raise BadDataset(
            f"{paths[0]}: physics has no lift_height, without which the part's pose is not known"
        )

    def episodes() -> Iterator[Episode]:
        for path in watch(paths):
            attempts, own = read_shard(path)
            _same_settings(path, own, [info])
            if attempts.depth.shape[1:] != size:
                raise BadDataset(f"{path}: depth images of another size than {size}; collect it again")
            # Where the arm errs, the hand was not where it was sent, and where it was is not stored.
            after = _pose_after(attempts, np.nan if _arm_errs(own) else lift_height)
            for row in range(len(attempts)):
                won = bool(attempts.success[row])
                yield Episode(
                    part=own.part,
                    grasp=attempts.grasp[row],
                    depth=np.nan_to_num(u16_to_depth(attempts.depth[row])),
                    T_base_obj=np.stack([attempts.pose_base_obj[row], after[row]]),
                    success=won,
                    info=_outcome(attempts, own, row),
                )

    height = float(info.T_base_camera.position[2]) - info.table_z
    camera = dict(height=height, focal_px=float(info.intrinsics[0, 0]), n_pixels=int(size[0]))
    with _renamed_at_the_end(out.parent, files) as temporary:
        return write_trajectories(
            temporary / out.name,
            episodes(),
            env_kwargs=dict(
                obs_mode="depth",
                control_mode="grasp",
                physics=_physics(info),
                noise=dict(info.noise),
                camera=camera,
            ),
            intrinsics=info.intrinsics,
            T_base_camera=info.T_base_camera,
            description="random grasps of mskgrasp.collect, one a trajectory",
        )


def _arm_errs(info: ShardInfo) -> bool:
    return any(info.noise.get(name) for name in ("arm_position_std", "arm_angle_std"))


def _pose_after(attempts: Attempts, lift_height: float) -> np.ndarray:
    """(n, 7) the part after the lift, base frame; NaN where it failed: the hand's place is not stored."""
    if not np.isfinite(lift_height):
        return np.full((len(attempts), 7), np.nan)
    lifted = attempts.grasp.astype(np.float64)
    lifted[:, 2] += lift_height
    after = pose_base_tcp(lifted) @ Pose.from_vector(attempts.pose_tcp_obj_after.astype(np.float64))
    return np.where(attempts.success[:, None], after.as_vector(), np.nan)


def _physics(info: ShardInfo) -> dict[str, Any]:
    """The settings of a shard; one that knows of no coarse rate was simulated finely throughout."""
    return dict(coarse_rate_hz=info.physics.get("rate_hz")) | info.physics


def _outcome(attempts: Attempts, info: ShardInfo, row: int) -> dict[str, Any]:
    known: dict[str, Any] = dict(part=info.part, family=info.family, part_hash=info.part_hash)
    known["failure"] = FAILURES[attempts.failure[row]]
    if attempts.success[row]:
        known["displacement"] = [float(value) for value in attempts.displacement[row]]
        known["tilt"] = float(attempts.tilt[row])
        known["width_after"] = float(attempts.width_after[row])
    return known


def _parts(infos: list[ShardInfo]) -> dict[str, _Part]:
    parts: dict[str, _Part] = {}
    for info in infos:
        own = _Part(hash=info.part_hash, family=info.family)
        if parts.setdefault(info.part, own) != own:
            raise BadDataset(f"part '{info.part}' changed while it was collected; check the dataset")
    return parts


def _same_settings(path: Path, info: ShardInfo, first: Sequence[ShardInfo]) -> None:
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


class _renamed_at_the_end:  # noqa: N801 (reads as a verb where it is used)
    """A folder for files that take their place beside it when all of them are written."""

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
