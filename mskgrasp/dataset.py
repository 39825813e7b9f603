"""Grasp attempts on disk: one HDF5 file a shard, written whole or not at all, checked when read."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from mskgrasp.errors import BadDataset
from mskgrasp.geometry import Pose
from mskgrasp.grasp import FAILURES

SCHEMA_VERSION = 1
DEPTH_UNIT = 1e-4
"""Metres that one step of a stored depth stands for."""
_FORMAT = "mskgrasp-shard"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_POSE = "m m m 1 1 1 1 (x y z qw qx qy qz)"


@dataclass(frozen=True)
class _Column:
    dtype: str
    shape: tuple[int, ...] | None  # after the leading n; None: an image of any size
    unit: str
    frame: str
    finite: str  # which rows must hold finite numbers


_COLUMNS = {
    "depth": _Column("uint16", None, "0.1 mm, 0 = invalid", "camera", "all"),
    "grasp": _Column("float32", (4,), "m m m rad (x y z theta)", "base", "all"),
    "success": _Column("bool", (), "1", "-", "all"),
    "failure": _Column("uint8", (), "index into failure_names", "-", "all"),
    "displacement": _Column("float32", (4,), "m m m rad (dx dy dz dtheta)", "grasp", "successful"),
    "tilt": _Column("float32", (), "rad", "grasp", "successful"),
    "width_after": _Column("float32", (), "m", "-", "successful"),
    "pose_base_obj": _Column("float32", (7,), _POSE, "base", "all"),
    "pose_tcp_obj_before": _Column("float32", (7,), _POSE, "tcp, commanded", "all"),
    "pose_tcp_obj_after": _Column("float32", (7,), _POSE, "tcp, measured", "successful"),
}


@dataclass(frozen=True, kw_only=True)
class Attempts:
    """n grasp attempts, one row each; frames and definitions as in `mskgrasp.grasp`.

    Attributes:
        depth: (n, h, w) uint16 in 0.1 mm along the optical axis, 0 where invalid, before the arm enters.
        grasp: (n, 4) float32, metres and radians, base frame.
        success: (n,) bool.
        failure: (n,) uint8, index into `mskgrasp.grasp.FAILURES`; 0 where successful.
        displacement: (n, 4) float32 object displacement, NaN where not successful.
        tilt: (n,) float32, radians.
        width_after: (n,) float32 distance between the pads at the end, metres.
        pose_base_obj: (n, 7) float32, x y z qw qx qy qz, at rest before the grasp.
        pose_tcp_obj_before: (n, 7) float32, in the commanded TCP.
        pose_tcp_obj_after: (n, 7) float32, in the measured TCP once lifted.
    """

    depth: np.ndarray
    grasp: np.ndarray
    success: np.ndarray
    failure: np.ndarray
    displacement: np.ndarray
    tilt: np.ndarray
    width_after: np.ndarray
    pose_base_obj: np.ndarray
    pose_tcp_obj_before: np.ndarray
    pose_tcp_obj_after: np.ndarray

    def __len__(self) -> int:
        return len(self.grasp)

    @classmethod
    def concatenate(cls, pieces: Sequence[Attempts]) -> Attempts:
        """The rows of all pieces, in order.

        Raises:
            BadDataset: No piece, or depth images of different sizes.
        """
        if not pieces:
            raise BadDataset("no attempts to join; collect some first: python -m mskgrasp.collect")
        sizes = sorted({piece.depth.shape[1:] for piece in pieces})
        if len(sizes) > 1:
            raise BadDataset(f"depth images of different sizes {sizes}; use shards of one camera setting")
        return cls(
            **{f.name: np.concatenate([getattr(piece, f.name) for piece in pieces]) for f in fields(cls)}
        )


@dataclass(frozen=True, kw_only=True)
class ShardInfo:
    """What all attempts of one shard share.

    Attributes:
        part: Name of the part, also the beginning of the file's name.
        part_hash: Content hash of the part that was grasped.
        family: Kind of part.
        index: Which shard of the part this is.
        seed: Everything random in the shard follows from it.
        intrinsics: (3, 3) pinhole matrix of the depth camera, pixels.
        T_base_camera: Pose of the camera's optical frame in the base.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        physics: Settings of the simulation.
        versions: Software versions.
        discarded: Why and how often an attempt was thrown away.
    """

    part: str
    part_hash: str
    family: str
    index: int
    seed: int
    intrinsics: np.ndarray
    T_base_camera: Pose
    table_z: float
    region: tuple[float, float, float, float]
    physics: dict[str, Any]
    versions: dict[str, str]
    discarded: dict[str, int]


def depth_to_u16(depth: np.ndarray) -> np.ndarray:
    """Metres (float, NaN = invalid) to 0.1 mm (uint16, 0 = invalid).

    Raises:
        BadDataset: A depth is negative or above 6.5535 m.
    """
    valid = np.isfinite(depth)
    steps = np.rint(np.where(valid, depth, 0.0) / DEPTH_UNIT)
    if steps.size and (steps.min() < 0 or steps.max() > np.iinfo(np.uint16).max):
        worst = float(steps.max() if steps.max() > np.iinfo(np.uint16).max else steps.min()) * DEPTH_UNIT
        raise BadDataset(f"depth {worst:g} is outside 0..6.5535 m; is the image in millimetres?")
    return steps.astype(np.uint16)


def u16_to_depth(depth_u16_dmm: np.ndarray) -> np.ndarray:
    """0.1 mm (uint16, 0 = invalid) to metres (float32, NaN = invalid)."""
    depth = depth_u16_dmm.astype(np.float32) * np.float32(DEPTH_UNIT)
    return np.where(depth_u16_dmm == 0, np.float32(np.nan), depth)


def shard_path(folder: Path, part: str, index: int) -> Path:
    """Where a shard of a dataset lies.

    Raises:
        BadDataset: The part's name cannot begin a file name.
    """
    if not _NAME.fullmatch(part):
        raise BadDataset(f"part name {part!r} cannot be a file name; use letters, digits, '.', '-' and '_'")
    return Path(folder) / "shards" / f"{part}-{index:04d}.h5"


def list_shards(folder: Path) -> list[Path]:
    """The finished shards of a dataset in the order of their names.

    Raises:
        BadDataset: No such folder, or no finished shard in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise BadDataset(
            f"no dataset folder {folder}; collect one: python -m mskgrasp.collect --out {folder}"
        )
    paths = sorted(path for path in (folder / "shards").glob("*.h5") if path.is_file())
    if not paths:
        raise BadDataset(
            f"no shards/*.h5 in {folder}; collect some: python -m mskgrasp.collect --out {folder}"
        )
    return paths


def write_shard(path: Path, attempts: Attempts, info: ShardInfo) -> None:
    """Writes a shard so that either all of it or nothing is ever seen under its name.

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
    temporary = path.with_name(path.name + ".tmp")
    try:
        with open(temporary, "wb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _file_image(attempts: Attempts, info: ShardInfo) -> bytes:
    # Built in memory: HDF5 that runs into a full disk leaves a handle that can no longer be closed.
    with h5py.File("shard", "w", driver="core", backing_store=False) as file:
        for name, column in _COLUMNS.items():
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
        for name in ("part", "part_hash", "family", "index", "seed", "table_z"):
            file.attrs[name] = getattr(info, name)
        file.attrs["intrinsics"] = np.asarray(info.intrinsics, dtype=np.float64)
        pose = np.asarray(info.T_base_camera.as_vector(), dtype=np.float64)
        file.attrs["T_base_camera"] = pose
        file.attrs["T_base_camera_layout"] = "x y z qw qx qy qz, metres"
        file.attrs["region"] = np.asarray(info.region, dtype=np.float64)
        file.attrs["region_layout"] = "x_min x_max y_min y_max, base, metres"
        for name in ("physics", "versions", "discarded"):
            file.attrs[name] = json.dumps(getattr(info, name), sort_keys=True)
        file.flush()
        return file.id.get_file_image()


def read_shard(path: Path) -> tuple[Attempts, ShardInfo]:
    """Reads and checks a shard.

    Raises:
        BadDataset: The file is missing, truncated, foreign, of another schema, or contradicts it.
    """
    arrays, info = _read(path, tuple(_COLUMNS))
    attempts = Attempts(**arrays)
    _check(attempts, str(path))
    return attempts, info


def read_success(path: Path) -> tuple[np.ndarray, ShardInfo]:
    """Reads which attempts of a shard lifted the part, (n,) bool, without the images.

    Raises:
        BadDataset: The file is missing, truncated, foreign or of another schema.
    """
    arrays, info = _read(path, ("success",))
    success = arrays["success"]
    if success.dtype != np.bool_ or success.ndim != 1:
        raise BadDataset(f"{path}: success is {success.dtype} {success.shape}, must be bool (n,); delete it")
    return success, info


def _read(path: Path, names: tuple[str, ...]) -> tuple[dict[str, np.ndarray], ShardInfo]:
    path = Path(path)
    if not path.is_file():
        raise BadDataset(f"no shard {path}; collect it: python -m mskgrasp.collect")
    try:
        with h5py.File(path, "r") as file:
            _check_header(file, path)
            return {name: np.asarray(file[name]) for name in names}, _read_info(file)
    except BadDataset:
        raise
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:
        # h5py reports damage with whichever of these its call stack ends in.
        problem = " ".join(str(error).split()).strip("'\"")
        raise BadDataset(
            f"{path} is damaged or no HDF5 file ({problem}); delete it and collect again"
        ) from error


def _check_header(file: h5py.File, path: Path) -> None:
    kind = file.attrs.get("format")
    if kind != _FORMAT:
        raise BadDataset(f"{path} is HDF5 but no grasp shard (format {kind!r}); remove it")
    version = file.attrs.get("schema_version")
    if version != SCHEMA_VERSION:
        raise BadDataset(f"{path} has schema version {version}, legal: {SCHEMA_VERSION}; collect it again")
    missing = [name for name in _COLUMNS if not isinstance(file.get(name), h5py.Dataset)]
    if missing:
        raise BadDataset(f"{path} lacks the array {', '.join(missing)}; delete it and collect again")
    names = tuple(np.asarray(file["failure"].attrs["failure_names"]).tolist())
    if names != FAILURES:
        raise BadDataset(f"{path} names failures {names}, legal: {FAILURES}; collect it again")


def _read_info(file: h5py.File) -> ShardInfo:
    attrs: dict[str, Any] = dict(file.attrs)
    x_min, x_max, y_min, y_max = (float(value) for value in attrs["region"])
    intrinsics = np.asarray(attrs["intrinsics"], dtype=np.float64).reshape(3, 3)
    pose = np.asarray(attrs["T_base_camera"], dtype=np.float64).reshape(7)
    if not (np.isfinite(intrinsics).all() and np.isfinite(pose).all()):
        raise ValueError("camera calibration is not finite")
    return ShardInfo(
        part=str(attrs["part"]),
        part_hash=str(attrs["part_hash"]),
        family=str(attrs["family"]),
        index=int(attrs["index"]),
        seed=int(attrs["seed"]),
        intrinsics=intrinsics,
        T_base_camera=Pose.from_vector(pose),
        table_z=float(attrs["table_z"]),
        region=(x_min, x_max, y_min, y_max),
        physics=json.loads(attrs["physics"]),
        versions=json.loads(attrs["versions"]),
        discarded=json.loads(attrs["discarded"]),
    )


def _check(attempts: Attempts, source: str) -> None:
    for problem in _problems(attempts):
        raise BadDataset(f"{source}: {problem}; delete it and collect again")


def _problems(attempts: Attempts) -> Iterator[str]:
    n = len(attempts)
    for name, column in _COLUMNS.items():
        array = getattr(attempts, name)
        if array.dtype != np.dtype(column.dtype):
            yield f"{name} is {array.dtype}, must be {column.dtype}"
        rest = array.shape[1:3] if column.shape is None else column.shape
        if array.shape != (n, *rest) or (column.shape is None and array.ndim != 3):
            wanted = "h, w" if column.shape is None else ", ".join(map(str, column.shape))
            yield f"{name} has shape {array.shape}, must be ({n}, {wanted})"
    for name, column in _COLUMNS.items():
        array = getattr(attempts, name)
        rows = np.ones(n, bool) if column.finite == "all" else attempts.success
        bad = np.flatnonzero(rows & ~np.isfinite(array.reshape(n, -1)).all(axis=1)) if n else []
        if len(bad):
            yield f"{name} of attempt {bad[0]} is not finite ({len(bad)} of {int(rows.sum())} such)"
    unknown = np.flatnonzero(attempts.failure >= len(FAILURES))
    if len(unknown):
        yield f"failure {attempts.failure[unknown[0]]} of attempt {unknown[0]}, legal 0..{len(FAILURES) - 1}"
    odd = np.flatnonzero((attempts.failure == 0) != attempts.success)
    if len(odd):
        code, held = attempts.failure[odd[0]], bool(attempts.success[odd[0]])
        yield f"attempt {odd[0]} has success {held} with failure {code} ({FAILURES[code]})"
    told = np.flatnonzero(~attempts.success & ~np.isnan(attempts.displacement).all(axis=1))
    if len(told):
        yield f"displacement of attempt {told[0]} is given though it failed, must be NaN"
    for name in ("pose_base_obj", "pose_tcp_obj_before", "pose_tcp_obj_after"):
        rows = attempts.success if _COLUMNS[name].finite == "successful" else np.ones(n, bool)
        length = np.linalg.norm(getattr(attempts, name)[:, 3:], axis=1)
        bad = np.flatnonzero(rows & (np.abs(length - 1) > 1e-3))
        if len(bad):
            yield f"{name} of attempt {bad[0]} has a quaternion of length {length[bad[0]]:.3g}, must be 1"
