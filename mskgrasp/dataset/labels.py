"""Labels of a dataset without its images, in one small file from which the dataset can be made again.

The images are nine tenths of a dataset and follow from the seed; the labels take nearly all of the time. A
collection that is given such a file (`mskgrasp.collect --labels`) renders its scenes instead of simulating
its grasps. Poses are rounded to 1 um, displacements are computed from them again.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from mskgrasp.core.errors import BadDataset, MissingDataset
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import object_displacement, pose_base_tcp
from mskgrasp.dataset.attempts import COLUMNS, ShardInfo
from mskgrasp.dataset.export import Watch, check_export_path, same_settings
from mskgrasp.dataset.shards import DAMAGE, list_shards, raise_system_error, read_columns, require_counts

_FORMAT = "mskgrasp-labels"
LABELS_VERSION = 1
_DIGITS = {
    "width_after": 6, "relative_speed": 6, "pose_base_obj": 6, "pose_tcp_obj_after": 6,
    "finger_force": 4, "friction_pad_part": 4,
}  # fmt: skip
"""Decimals of the columns that are rounded."""
_EXACT = ("grasp", "failure", "attempt", "draw")
_OWN = ("part", "part_hash", "family", "index", "seed", "discarded", "redrawn", "toppled")
"""Properties in which shards of a dataset differ."""
_MOST_BYTES = 2**31
"""Largest plausible array: the poses of 2**26 attempts."""


@dataclass(frozen=True, kw_only=True)
class ShardLabels:
    """What a shard holds beside its images.

    Attributes:
        columns: Arrays (n, ...) of every column of `mskgrasp.dataset.Attempts` but ``depth``.
        info: Properties that its attempts share.
    """

    columns: dict[str, np.ndarray]
    info: ShardInfo


def export_labels(folder: Path, out: Path, watch: Watch = iter) -> int:
    """Write the labels of a dataset into one HDF5 file.

    Returns:
        The number of attempts.

    Raises:
        BadDataset: A shard is damaged, the shards do not belong together, or are older than schema 3.
        UsageError: The file exists, or cannot be made.
        OSError: The disk is full or not writable.
    """
    check_export_path(folder, out, ".labels")
    names = (*_EXACT, *_DIGITS)
    pieces: dict[str, list[np.ndarray]] = {name: [] for name in names}
    infos: list[ShardInfo] = []
    for path in watch(list_shards(folder)):
        columns, info = read_columns(path, names)
        if (columns["attempt"] < 0).any():
            raise BadDataset(
                f"{path} does not number its attempts, as shards of schema 3 do; collect it again"
            )
        same_settings(path, info, infos[:1])
        if infos and info.versions != infos[0].versions:
            raise BadDataset(f"{path} was made by other software than the first shard; export them apart")
        infos.append(info)
        for name in names:
            pieces[name].append(columns[name])
    counts = [len(one) for one in pieces["failure"]]
    joined = {name: np.concatenate(one) for name, one in pieces.items()}
    held = joined["failure"] == 0
    # Built in memory: on a full disk HDF5 leaves a handle that cannot be closed.
    with h5py.File("labels", "w", libver="latest", driver="core", backing_store=False) as file:
        file.attrs["format"], file.attrs["version"] = _FORMAT, LABELS_VERSION
        # As data, not attributes, which HDF5 limits to 64 kB.
        for name, record in (
            ("shared", _to_json(infos[0], exclude=_OWN)),
            ("shards", [_to_json(info, only=_OWN) | {"n": n} for info, n in zip(infos, counts, strict=True)]),
        ):
            text = np.frombuffer(json.dumps(record, sort_keys=True).encode(), np.uint8)
            file.create_dataset(name, data=text, compression="gzip", compression_opts=9, track_times=False)
        for name, values in joined.items():
            options: dict[str, Any] = {}
            if name in _DIGITS:
                # Rounding knows no NaN, and where the part is after a failed grasp is nobody's label.
                rows = held if name != "relative_speed" and COLUMNS[name].finite == "successful" else ...
                values = _only(values, rows)
                options["scaleoffset"] = _DIGITS[name]
            if len(values):
                options |= {"compression": "gzip", "compression_opts": 9, "shuffle": True, "chunks": True}
            file.create_dataset(name, data=values, track_times=False, **options)
        file.flush()
        image = file.id.get_file_image()
    write_whole(out, image)
    return sum(counts)


def _only(values: np.ndarray, rows: Any) -> np.ndarray:
    kept = np.full_like(values, -1.0)
    kept[rows] = values[rows]
    return np.nan_to_num(kept, nan=-1.0)


def read_labels(paths: Iterable[Path]) -> dict[tuple[str, int], ShardLabels]:
    """Read files of labels; by name of the part and index of the shard.

    Raises:
        BadDataset: A file is missing, foreign or damaged, or two hold the same shard.
        OSError: The system cannot open or read one.
    """
    found: dict[tuple[str, int], ShardLabels] = {}
    for path in paths:
        for one in _read(Path(path)):
            key = (one.info.part, one.info.index)
            if key in found:
                raise BadDataset(f"{path} holds shard {key[1]} of part '{key[0]}' again; name each file once")
            found[key] = one
    return found


def _read(path: Path) -> list[ShardLabels]:
    if not path.is_file():
        raise MissingDataset(f"no file of labels {path}; write one: python -m mskgrasp.dataset export")
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("format") != _FORMAT or file.attrs.get("version") != LABELS_VERSION:
                raise ValueError("it holds no labels of this version")
            shared, shards = (
                json.loads(_array(file, name, "uint8", ()).tobytes()) for name in ("shared", "shards")
            )
            arrays = {
                name: _array(file, name, COLUMNS[name].dtype, COLUMNS[name].shape)
                for name in (*_EXACT, *_DIGITS)
            }
        counts = [int(shard.pop("n")) for shard in shards]
        if min(counts, default=0) < 0 or any(len(values) != sum(counts) for values in arrays.values()):
            raise ValueError("its arrays do not fit its shards")
        columns = _columns(arrays)
        ends = np.cumsum([0, *counts])
        return [
            ShardLabels(
                columns={name: values[start:end] for name, values in columns.items()},
                info=_from_json(shared | shard),
            )
            for shard, start, end in zip(shards, ends[:-1], ends[1:], strict=True)
        ]
    except (*DAMAGE, MemoryError) as error:
        raise_system_error(error, path)
        problem = " ".join(str(error).split()).strip("'\"")
        raise BadDataset(f"{path} is damaged or no file of labels ({problem})") from error


def _array(file: h5py.File, name: str, dtype: str, row: tuple[int, ...] | None) -> np.ndarray:
    stored = file[name]
    link = file.get(name, getlink=True)
    if not isinstance(stored, h5py.Dataset) or not isinstance(link, h5py.HardLink):
        raise ValueError(f"{name} is no array of its own")
    if stored.external or stored.is_virtual:
        raise ValueError(f"{name} lies in another file")
    # A damaged file can claim any size: it is bounded before anything is allocated.
    fits = stored.dtype.kind == np.dtype(dtype).kind and stored.shape[1:] == row
    if not fits or stored.size * stored.dtype.itemsize > _MOST_BYTES:
        raise ValueError(f"{name} claims the type {stored.dtype} and the shape {stored.shape}")
    return np.asarray(stored)


def _columns(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """All columns but the images, from those that are stored."""
    success = arrays["failure"] == 0
    rest, after = (
        Pose.from_vector(_unit(arrays[name].astype(np.float64)))
        for name in ("pose_base_obj", "pose_tcp_obj_after")
    )
    before = pose_base_tcp(arrays["grasp"].astype(np.float64)).inverse() @ rest
    displacement, tilt = object_displacement(before, after)
    made = dict(
        arrays,
        success=success,
        displacement=displacement,
        tilt=tilt,
        pose_base_obj=rest.as_vector(),
        pose_tcp_obj_before=before.as_vector(),
        pose_tcp_obj_after=after.as_vector(),
    )
    for name in ("displacement", "tilt", "width_after", "pose_tcp_obj_after"):
        made[name] = np.array(made[name])
        made[name][~success] = np.nan
    for name in ("relative_speed", "finger_force", "friction_pad_part"):  # stored as -1 where unknown
        made[name] = np.where(arrays[name] < 0, np.nan, arrays[name])
    return {name: made[name].astype(column.dtype) for name, column in COLUMNS.items() if name != "depth"}


def _unit(poses: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return np.concatenate([poses[:, :3], poses[:, 3:] / np.where(length > 0, length, 1)], axis=1)


def _to_json(info: ShardInfo, *, only: Iterable[str] = (), exclude: Iterable[str] = ()) -> dict[str, Any]:
    names = tuple(only) or [field.name for field in fields(info) if field.name not in exclude]
    record = {name: getattr(info, name) for name in names}
    if "intrinsics" in record:
        record["intrinsics"] = np.asarray(info.intrinsics).tolist()
        record["T_base_camera"] = np.asarray(info.T_base_camera.as_vector()).tolist()
    return record


def _from_json(record: dict[str, Any]) -> ShardInfo:
    x_min, x_max, y_min, y_max = (float(value) for value in record["region"])
    info = ShardInfo(**record)
    if not (isinstance(info.part, str) and isinstance(info.index, int) and isinstance(info.discarded, dict)):
        raise ValueError("a shard has no part, index and numbers of discarded attempts")
    require_counts(info.discarded)
    return replace(
        info,
        region=(x_min, x_max, y_min, y_max),
        intrinsics=np.array(record["intrinsics"], dtype=np.float64).reshape(3, 3),
        T_base_camera=Pose.from_vector(np.array(record["T_base_camera"], dtype=np.float64).reshape(7)),
    )
