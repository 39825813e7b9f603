"""Grasp attempts, the properties that those of a shard share, and the schema of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.settings import Physics

DEPTH_UNIT = 1e-4
"""Resolution of a stored depth, metres."""
_POSE = "m m m 1 1 1 1 (x y z qw qx qy qz)"


@dataclass(frozen=True)
class Column:
    """Storage of one array of a shard."""

    dtype: str
    shape: tuple[int, ...] | None  # after the leading n; None: an image of any size
    unit: str
    frame: str
    finite: Literal["all", "successful", "none"]  # which rows must hold finite numbers
    since: int = 1  # version of the schema; in older shards the column is NaN, or -1 where it is of integers


COLUMNS = {
    "depth": Column("uint16", None, "0.1 mm, 0 = invalid", "camera", "all"),
    "grasp": Column("float32", (4,), "m m m rad (x y z theta)", "base", "all"),
    "success": Column("bool", (), "1", "-", "all"),
    "failure": Column("uint8", (), "index into failure_names", "-", "all"),
    "displacement": Column("float32", (4,), "m m m rad (dx dy dz dtheta)", "grasp", "successful"),
    "tilt": Column("float32", (), "rad", "grasp", "successful"),
    "width_after": Column("float32", (), "m", "-", "successful"),
    "relative_speed": Column("float32", (), "m/s", "tcp, measured", "none", since=2),
    "pose_base_obj": Column("float32", (7,), _POSE, "base", "all"),
    "pose_tcp_obj_before": Column("float32", (7,), _POSE, "tcp, commanded", "all"),
    "pose_tcp_obj_after": Column("float32", (7,), _POSE, "tcp, measured", "successful"),
    "attempt": Column("int32", (), "number among the part's attempts", "-", "all", since=3),
    "draw": Column("int32", (), "1", "-", "all", since=3),
    "finger_force": Column("float32", (), "N", "-", "none", since=3),
    "friction_pad_part": Column("float32", (), "1", "-", "none", since=3),
}


@dataclass(frozen=True, kw_only=True)
class Attempts:
    """n grasp attempts, one row each; frames and definitions as in `mskgrasp.core.grasp`.

    Attributes:
        depth: (n, h, w) uint16 in 0.1 mm along the optical axis, 0 where invalid, before the arm enters.
        grasp: (n, 4) float32, metres and radians, base frame.
        success: (n,) bool.
        failure: (n,) uint8, index into `mskgrasp.core.grasp.FAILURES`; 0 where successful.
        displacement: (n, 4) float32 object displacement, NaN where not successful.
        tilt: (n,) float32, radians.
        width_after: (n,) float32 distance between the pads at the end, metres.
        relative_speed: (n,) float32 speed of the part in the hand when it was judged, m/s; NaN where
            nothing was lifted, or unknown.
        pose_base_obj: (n, 7) float32, x y z qw qx qy qz, at rest before the grasp.
        pose_tcp_obj_before: (n, 7) float32, in the commanded TCP.
        pose_tcp_obj_after: (n, 7) float32, in the measured TCP once lifted.
        attempt: (n,) int32 number among the attempts of the part, discarded ones included; -1 where unknown.
        draw: (n,) int32 times that its scene was drawn again, because the part was not at rest; likewise.
        finger_force: (n,) float32 force of each pad, drawn or that of the settings, N; NaN where unknown.
        friction_pad_part: (n,) float32 coefficient between pads and part, likewise.
    """

    depth: np.ndarray
    grasp: np.ndarray
    success: np.ndarray
    failure: np.ndarray
    displacement: np.ndarray
    tilt: np.ndarray
    width_after: np.ndarray
    relative_speed: np.ndarray
    pose_base_obj: np.ndarray
    pose_tcp_obj_before: np.ndarray
    pose_tcp_obj_after: np.ndarray
    attempt: np.ndarray
    draw: np.ndarray
    finger_force: np.ndarray
    friction_pad_part: np.ndarray

    def __len__(self) -> int:
        return len(self.grasp)

    @classmethod
    def concatenate(cls, pieces: Sequence[Attempts]) -> Attempts:
        """Join the rows of all pieces, in order.

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
    """Properties that all attempts of one shard share.

    Attributes:
        part: Name of the part, with which the file's name begins.
        part_hash: Content hash of the part.
        family: Kind of part.
        index: Number of the shard among those of the part.
        seed: Seed of all random numbers in the dataset.
        intrinsics: (3, 3) pinhole matrix of the depth camera, pixels.
        T_base_camera: Pose of the camera's optical frame in the base.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max of the parts' centres, base frame, metres.
        physics: Settings of the simulation.
        versions: Software versions.
        discarded: Number of discarded attempts by reason.
        redrawn: Number of scenes drawn again because the part was not at rest.
        toppled: Probability of the resting poses that the engine does not hold, which are left out.
        fidelity: Class of the labels, which must not be mixed: "cpu", or "gpu" for PhysX on a GPU, where
            contact points are cached and overlaps of hand and part are not seen.
        hand: Measures of the hand, metres; empty: not recorded.
        noise: Simulated errors of the cell; empty: none.
        planner: Digest of the model whose planner chose the grasps; empty: they are random.
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
    redrawn: int = 0
    toppled: float = 0.0
    fidelity: str = "cpu"
    hand: dict[str, float] = field(default_factory=dict)
    noise: dict[str, Any] = field(default_factory=dict)
    planner: str = ""


def depth_to_u16(depth: np.ndarray) -> np.ndarray:
    """Convert metres (float, NaN = invalid) to 0.1 mm (uint16, 0 = invalid).

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
    """Convert 0.1 mm (uint16, 0 = invalid) to metres (float32, NaN = invalid)."""
    depth = depth_u16_dmm.astype(np.float32) * np.float32(DEPTH_UNIT)
    return np.where(depth_u16_dmm == 0, np.float32(np.nan), depth)


def shape_problems(arrays: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Find wrong types and shapes in arrays of a shard, a sentence each."""
    lengths = [len(array) for array in arrays.values() if array.ndim]
    n = max(set(lengths), key=lengths.count) if lengths else 0
    for name, array in arrays.items():
        column = COLUMNS[name]
        if array.dtype != np.dtype(column.dtype):
            yield f"{name} is {array.dtype}, must be {column.dtype}"
        rest = array.shape[1:3] if column.shape is None else column.shape
        if array.shape != (n, *rest) or (column.shape is None and array.ndim != 3):
            wanted = "h, w" if column.shape is None else ", ".join(map(str, column.shape))
            yield f"{name} has shape {array.shape}, must be ({n}, {wanted})"
        elif column.shape is None and 0 in array.shape[1:]:
            yield f"{name} has shape {array.shape}: its images are empty"


def problems(attempts: Attempts) -> Iterator[str]:
    """Find contradictions of the schema in attempts, a sentence each."""
    wrong = list(shape_problems({name: getattr(attempts, name) for name in COLUMNS}))
    yield from wrong
    if wrong:
        return  # values of arrays with wrong shapes cannot be compared
    n = len(attempts)
    for name, column in COLUMNS.items():
        array = getattr(attempts, name)
        if column.finite == "none":
            continue
        rows = np.ones(n, bool) if column.finite == "all" else attempts.success
        bad = np.flatnonzero(rows & ~np.isfinite(array.reshape(n, -1)).all(axis=1)) if n else []
        if len(bad):
            yield f"{name} of attempt {bad[0]} is not finite ({len(bad)} of {int(rows.sum())} such)"
    known = attempts.failure < len(FAILURES)
    unknown = np.flatnonzero(~known)
    if len(unknown):
        yield f"failure {attempts.failure[unknown[0]]} of attempt {unknown[0]}, legal 0..{len(FAILURES) - 1}"
    odd = np.flatnonzero(known & ((attempts.failure == 0) != attempts.success))
    if len(odd):
        code, held = attempts.failure[odd[0]], bool(attempts.success[odd[0]])
        yield f"attempt {odd[0]} has success {held} with failure {code} ({FAILURES[code]})"
    given = np.flatnonzero(~attempts.success & ~np.isnan(attempts.displacement).all(axis=1))
    if len(given):
        yield f"displacement of attempt {given[0]} is given though it failed, must be NaN"
    for name in ("pose_base_obj", "pose_tcp_obj_before", "pose_tcp_obj_after"):
        rows = attempts.success if COLUMNS[name].finite == "successful" else np.ones(n, bool)
        length = np.linalg.norm(getattr(attempts, name)[:, 3:], axis=1)
        bad = np.flatnonzero(rows & (np.abs(length - 1) > 1e-3))
        if len(bad):
            yield f"{name} of attempt {bad[0]} has a quaternion of length {length[bad[0]]:.3g}, must be 1"


def physics_of(info: ShardInfo) -> dict[str, Any]:
    """Get those settings of a shard that the task has; settings of older versions would be refused.

    A shard without a coarse rate was simulated at the full rate throughout.
    """
    known = {name: value for name, value in info.physics.items() if name in Physics.model_fields}
    return dict(coarse_rate_hz=info.physics.get("rate_hz")) | known
