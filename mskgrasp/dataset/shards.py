"""Storage of grasp attempts: one HDF5 file for each shard, written atomically, checked when read."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from mskgrasp.core.errors import BadDataset, MissingDataset
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset.attempts import COLUMNS, Attempts, ShardInfo, problems, shape_problems

SCHEMA_VERSION = 3
"""Version 1 had no relative speeds, and stored attempts at parts that were not at rest as failures; version 2
had neither number, force nor friction of each attempt."""
DAMAGE = OSError, RuntimeError, LookupError, ArithmeticError, ValueError, TypeError, AttributeError
"""Errors with which h5py, and what reads its values, report damage, depending on where it is found."""
_FORMAT = "mskgrasp-shard"
_MOST_BYTES = 2**32
"""Largest plausible array: more than 10,000 images of the largest camera."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def shard_path(folder: Path, part: str, index: int) -> Path:
    """Get the path of a shard.

    Raises:
        BadDataset: The part's name cannot begin a file name.
    """
    if not _NAME.fullmatch(part):
        raise BadDataset(f"part name {part!r} cannot be a file name; use letters, digits, '.', '-' and '_'")
    return Path(folder) / "shards" / f"{part}-{index:04d}.h5"


def require_own_name(path: Path, info: ShardInfo) -> None:
    """Refuse a shard under another name than its part and index give: a copy would count twice.

    Raises:
        BadDataset: It has another name, or its part's name cannot be a file name.
    """
    name = shard_path(path.parent, info.part, info.index).name
    if path.name != name:
        raise BadDataset(
            f"{path} holds what {name} holds, shard {info.index} of part '{info.part}': delete the copy, or "
            "give it this name"
        )


def list_shards(folder: Path) -> list[Path]:
    """List the finished shards of a dataset, sorted by name.

    Raises:
        MissingDataset: No such folder, or no folder ``shards`` in it.
        BadDataset: No shard is finished.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise MissingDataset(
            f"no dataset folder {folder}; collect one: python -m mskgrasp.collect --out {folder}"
        )
    paths = sorted(path for path in (folder / "shards").glob("*.h5") if path.is_file())
    if not paths:
        kind = BadDataset if (folder / "shards").is_dir() else MissingDataset
        raise kind(f"no shards/*.h5 in {folder}; collect some: python -m mskgrasp.collect --out {folder}")
    return paths


def write_shard(path: Path, attempts: Attempts, info: ShardInfo) -> None:
    """Write a shard atomically.

    The same attempts and info give the same bytes.

    Raises:
        BadDataset: The attempts contradict the schema.
        OSError: The disk is full or not writable; nothing is left behind.
    """
    path = Path(path)
    _check(attempts, str(path))
    if not _NAME.fullmatch(info.part):
        raise BadDataset(f"{path}: part name {info.part!r}; use letters, digits, '.', '-' and '_'")
    image = _file_image(attempts, info)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, image)


def _file_image(attempts: Attempts, info: ShardInfo) -> bytes:
    # Built in memory: on a full disk HDF5 leaves a handle that cannot be closed.
    with h5py.File("shard", "w", driver="core", backing_store=False) as file:
        for name, column in COLUMNS.items():
            array = getattr(attempts, name)
            options: dict[str, Any] = {}
            if name == "depth" and array.size:
                options = {"chunks": (1, *array.shape[1:]), "compression": "gzip"}
                options |= {"compression_opts": 1, "shuffle": True}
            stored = file.create_dataset(name, data=array, track_times=False, **options)
            stored.attrs["unit"] = column.unit
            stored.attrs["frame"] = column.frame
        file["failure"].attrs["failure_names"] = list(FAILURES)
        file.attrs["format"] = _FORMAT
        file.attrs["schema_version"] = SCHEMA_VERSION
        for name in (
            "part", "part_hash", "family", "index", "seed", "table_z", "redrawn", "toppled", "fidelity",
            "planner",
        ):  # fmt: skip
            file.attrs[name] = getattr(info, name)
        file.attrs["intrinsics"] = np.asarray(info.intrinsics, dtype=np.float64)
        pose = np.asarray(info.T_base_camera.as_vector(), dtype=np.float64)
        file.attrs["T_base_camera"] = pose
        file.attrs["T_base_camera_layout"] = "x y z qw qx qy qz, metres"
        file.attrs["region"] = np.asarray(info.region, dtype=np.float64)
        file.attrs["region_layout"] = "x_min x_max y_min y_max, base, metres"
        for name in ("physics", "noise", "versions", "discarded", "hand"):
            file.attrs[name] = json.dumps(getattr(info, name), sort_keys=True)
        file.flush()
        return file.id.get_file_image()


def read_shard(path: Path) -> tuple[Attempts, ShardInfo]:
    """Read and check a shard.

    Raises:
        BadDataset: The file is missing, truncated, foreign, of another schema, or contradicts it.
        OSError: The system cannot open or read it.
    """
    attempts, info = read_unchecked(path)
    _check(attempts, str(path))
    return attempts, info


def read_unchecked(path: Path) -> tuple[Attempts, ShardInfo]:
    """Read a shard without checking its values, for programs that look for faults.

    Raises:
        BadDataset: The file is missing, truncated, foreign or of another schema.
        OSError: The system cannot open or read it.
    """
    arrays, info = _read(path, tuple(COLUMNS))
    return Attempts(**arrays), info


def read_columns(path: Path, names: Sequence[str]) -> tuple[dict[str, np.ndarray], ShardInfo]:
    """Read some of a shard's arrays, for example without the images; their values are not checked.

    Raises:
        BadDataset: The file is missing, truncated, foreign, of another schema, or an array has the wrong
            type or shape.
        OSError: The system cannot open or read it.
    """
    arrays, info = _read(path, tuple(names))
    for problem in shape_problems(arrays):
        raise BadDataset(f"{path}: {problem}; delete it and collect again")
    return arrays, info


def read_success(path: Path) -> tuple[np.ndarray, ShardInfo]:
    """Read which attempts of a shard lifted the part, (n,) bool, without the images.

    Raises:
        BadDataset: The file is missing, truncated, foreign or of another schema.
        OSError: The system cannot open or read it.
    """
    arrays, info = read_columns(path, ("success",))
    return arrays["success"], info


def success_rate(success: np.ndarray) -> float:
    """Share of attempts that lifted the part, of (n,) bool; 0 where all were discarded."""
    return float(success.mean()) if len(success) else 0.0


def _read(path: Path, names: tuple[str, ...]) -> tuple[dict[str, np.ndarray], ShardInfo]:
    path = Path(path)
    if not path.is_file():
        raise BadDataset(f"no shard {path}; collect it: python -m mskgrasp.collect")
    try:
        with h5py.File(path, "r") as file:
            _check_header(file, path)
            return {name: _array(file, name) for name in names}, _read_info(file)
    except BadDataset:
        raise
    except DAMAGE as error:
        raise_system_error(error, path)
        problem = " ".join(str(error).split()).strip("'\"")
        raise BadDataset(
            f"{path} is damaged or no HDF5 file ({problem}); delete it and collect again"
        ) from error


def raise_system_error(error: Exception, path: Path) -> None:
    """Raise an error of the operating system again, with the file's name: the file need not be damaged.

    h5py gives errors of the system their number, and HDF5's own none.

    Raises:
        OSError: It is an error of the system.
    """
    if isinstance(error, OSError) and error.errno is not None:
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from error


def _array(file: h5py.File, name: str) -> np.ndarray:
    stored = file.get(name)
    if stored is None:  # younger than the file, or _check_header would have refused it
        dtype = np.dtype(COLUMNS[name].dtype)
        return np.full(len(_array(file, "success")), np.nan if dtype.kind == "f" else -1, dtype)
    assert isinstance(stored, h5py.Dataset)  # checked by _check_header
    # The data must be in the shard itself: a foreign file must not make us read other files.
    link = file.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink) or stored.external or stored.is_virtual:
        raise ValueError(f"{name} lies in another file")
    # In a damaged file an array can claim any size, which must not be allocated.
    if stored.size * stored.dtype.itemsize > _MOST_BYTES:
        raise ValueError(f"{name} claims the shape {stored.shape}")
    return np.asarray(stored)


def _check_header(file: h5py.File, path: Path) -> None:
    kind = file.attrs.get("format")
    if kind != _FORMAT:
        raise BadDataset(f"{path} is HDF5 but no grasp shard (format {kind!r}); remove it")
    version: Any = file.attrs.get("schema_version")
    if version not in range(1, SCHEMA_VERSION + 1):
        legal = f"1 to {SCHEMA_VERSION}"
        raise BadDataset(f"{path} has schema version {version}, legal: {legal}; collect it again")
    due = [name for name, column in COLUMNS.items() if column.since <= version]
    missing = [name for name in due if not isinstance(file.get(name), h5py.Dataset)]
    if missing:
        raise BadDataset(f"{path} lacks the array {', '.join(missing)}; delete it and collect again")
    names = tuple(np.asarray(file["failure"].attrs["failure_names"]).tolist())
    if names != FAILURES[: len(names)]:  # names were added at the end
        raise BadDataset(f"{path} names failures {names}, legal: {FAILURES}; collect it again")


def _read_info(file: h5py.File) -> ShardInfo:
    attrs: dict[str, Any] = dict(file.attrs)
    x_min, x_max, y_min, y_max = (float(value) for value in attrs["region"])
    intrinsics = np.asarray(attrs["intrinsics"], dtype=np.float64).reshape(3, 3)
    pose = np.asarray(attrs["T_base_camera"], dtype=np.float64).reshape(7)
    if not (np.isfinite(intrinsics).all() and np.isfinite(pose).all()):
        raise ValueError("camera calibration is not finite")
    if not (intrinsics[0, 0] > 0 and intrinsics[1, 1] > 0 and np.array_equal(intrinsics[2], [0, 0, 1])):
        raise ValueError("intrinsics are those of no pinhole camera")
    return ShardInfo(
        part=_text(attrs["part"]),
        part_hash=_text(attrs["part_hash"]),
        family=_text(attrs["family"]),
        index=int(attrs["index"]),
        seed=int(attrs["seed"]),
        intrinsics=intrinsics,
        T_base_camera=Pose.from_vector(pose),
        table_z=float(attrs["table_z"]),
        region=(x_min, x_max, y_min, y_max),
        physics=_mapping(attrs, "physics"),
        versions=_mapping(attrs, "versions", str),
        discarded=require_counts(_mapping(attrs, "discarded", int)),
        redrawn=int(attrs.get("redrawn", 0)),
        toppled=float(attrs.get("toppled", 0.0)),
        fidelity=_text(attrs.get("fidelity", "cpu")),
        hand=_mapping(attrs, "hand") if "hand" in attrs else {},
        noise=_mapping(attrs, "noise") if "noise" in attrs else {},
        planner=_text(attrs.get("planner", "")),
    )


def _text(value: Any) -> str:
    text = str(value)
    # h5py hands on bytes that are no UTF-8 as surrogates, which no export can write.
    if text.encode(errors="ignore").decode() != text:
        raise ValueError(f"the text {text!r} is not UTF-8")
    return text


def _mapping(attrs: dict[str, Any], name: str, kind: type = object) -> dict[str, Any]:
    values = json.loads(attrs[name])
    if not isinstance(values, dict) or not all(isinstance(value, kind) for value in values.values()):
        raise ValueError(f"attribute {name} is no JSON object of such values")
    return values


def require_counts(discarded: dict[str, int]) -> dict[str, int]:
    """Refuse numbers of discarded attempts that are no numbers of attempts.

    Raises:
        ValueError: One is negative, or no whole number.
    """
    if not all(isinstance(n, int) and n >= 0 for n in discarded.values()):
        raise ValueError("discarded counts no attempts")
    return discarded


def _check(attempts: Attempts, source: str) -> None:
    with np.errstate(all="ignore"):  # a damaged number may be of any size
        found = list(problems(attempts))
    for problem in found:
        raise BadDataset(f"{source}: {problem}; delete it and collect again")
