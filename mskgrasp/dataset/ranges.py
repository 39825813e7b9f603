"""Plausibility checks of grasp attempts that obey the schema."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.core.geometry import Pose, pixel_rays, quat_conjugate, quat_multiply, quat_to_matrix
from mskgrasp.core.grasp import (
    MAX_DISPLACEMENT,
    MAX_OPENING,
    MIN_GAP,
    lowest_grasp_z,
    object_displacement,
    pose_base_tcp,
)
from mskgrasp.dataset.attempts import DEPTH_UNIT, Attempts, ShardInfo

AROUND_REGION = 0.05
"""Greatest reach of a part in the region, or of its grasp, beyond the region, metres."""
MAX_HEIGHT = 0.3
"""Greatest height of a graspable part above the table, metres."""
BELOW_TABLE = 0.05
"""Greatest measured depth below the table, by noise or an error of the camera's pose, metres."""
NEAREST = 0.2
"""Least distance that a depth camera measures, metres."""
_LENGTH, _ANGLE = 2e-4, 4e-3  # rounding errors of poses in single precision


def range_problems(attempts: Attempts, info: ShardInfo) -> Iterator[str]:
    """Find impossible values in attempts that obey the schema, a sentence each.

    Args:
        attempts: Must have passed `mskgrasp.dataset.attempts.problems`.
        info: Properties that they share.
    """
    yield from _info_problems(info, len(attempts))
    if not len(attempts):
        return
    yield from _label_problems(attempts)
    yield from _grasp_problems(attempts, info)
    yield from _pose_problems(attempts, info)
    yield from _depth_problems(attempts, info)


def _info_problems(info: ShardInfo, n: int) -> Iterator[str]:
    x_min, x_max, y_min, y_max = info.region
    if not (x_min < x_max and y_min < y_max):
        yield f"region {info.region} must be x_min < x_max, y_min < y_max"
    if not np.isfinite(info.table_z):
        yield f"table_z is {info.table_z}, must be finite"
    if abs(np.linalg.norm(info.T_base_camera.quat_wxyz) - 1) > 1e-3:
        yield "the quaternion of T_base_camera has not length 1"
    if info.index < 0 or info.seed < 0:
        yield f"index {info.index} and seed {info.seed} must not be negative"
    if not info.part_hash:
        yield "part_hash is empty"
    if n + sum(info.discarded.values()) == 0:
        yield "holds no attempt, and none was discarded"


def _label_problems(attempts: Attempts) -> Iterator[str]:
    held = attempts.success
    moved = np.linalg.norm(attempts.displacement[:, :3], axis=1)
    turned, tilt, width = attempts.displacement[:, 3], attempts.tilt, attempts.width_after
    yield from _first_bad(
        held & (moved > MAX_DISPLACEMENT), moved * 1e3,
        f"is called a success but moved {{:.1f}} mm in the hand, at most {MAX_DISPLACEMENT * 1e3:g}",
    )  # fmt: skip
    yield from _first_bad(
        held & (np.abs(turned) > np.pi + 1e-5), turned, "has dtheta {:.3f} rad, legal -pi..pi"
    )
    yield from _first_bad(
        held & ((tilt < 0) | (tilt > np.pi + 1e-5)), tilt, "has tilt {:.3f} rad, legal 0..pi"
    )
    yield from _first_bad(
        held & ((width < MIN_GAP - 1e-5) | (width > MAX_OPENING + 1e-3)), width * 1e3,
        "is called a success with pads {:.2f} mm apart, "
        f"legal {MIN_GAP * 1e3:g}..{MAX_OPENING * 1e3:g}",
    )  # fmt: skip


def _grasp_problems(attempts: Attempts, info: ShardInfo) -> Iterator[str]:
    x, y, z, theta = attempts.grasp.T.astype(np.float64)
    outside = _outside(x, y, info)
    yield from _first_bad(
        outside > AROUND_REGION, outside * 1e3, "has its grasp {:.0f} mm outside the region of the parts"
    )
    lowest = lowest_grasp_z(info.table_z)
    yield from _first_bad(z < lowest - 1e-5, z, f"has grasp z {{:.4f}} m, the lowest is {lowest:.4f}")
    highest = info.table_z + MAX_HEIGHT
    yield from _first_bad(z > highest, z, f"has grasp z {{:.4f}} m, the highest is {highest:.4f}")
    yield from _first_bad(np.abs(theta) > np.pi / 2 + 1e-5, theta, "has theta {:.4f} rad, legal -pi/2..pi/2")


def _pose_problems(attempts: Attempts, info: ShardInfo) -> Iterator[str]:
    T_base_obj = _poses(attempts.pose_base_obj)
    x, y, z = np.moveaxis(T_base_obj.position, -1, 0)
    outside = _outside(x, y, info)
    yield from _first_bad(
        outside > AROUND_REGION, outside * 1e3, "has its part {:.0f} mm outside the region of the parts"
    )
    height = z - info.table_z
    yield from _first_bad(
        (height < -0.01) | (height > MAX_HEIGHT), height * 1e3,
        f"has its part {{:.0f}} mm above the table, legal 0..{MAX_HEIGHT * 1e3:g}",
    )  # fmt: skip
    before = _poses(attempts.pose_tcp_obj_before)
    expected = pose_base_tcp(attempts.grasp.astype(np.float64)).inverse() @ T_base_obj
    length, angle = _apart(before, expected)
    yield from _first_bad(
        (length > _LENGTH) | (angle > _ANGLE), length * 1e3,
        "has a pose_tcp_obj_before that does not follow from grasp and pose_base_obj ({:.2f} mm off)",
    )  # fmt: skip
    held = attempts.success
    rows = np.flatnonzero(held)
    if not len(rows):
        return
    followed, tilt = object_displacement(
        _poses(attempts.pose_tcp_obj_before[rows]), _poses(attempts.pose_tcp_obj_after[rows])
    )
    off = np.zeros(len(attempts))
    difference = followed - attempts.displacement[rows]
    difference[:, 3] = (difference[:, 3] + np.pi) % (2 * np.pi) - np.pi
    wrong = np.zeros(len(attempts), bool)
    off[rows] = np.linalg.norm(difference[:, :3], axis=1)
    # The twist is undefined if the part was turned upside down.
    turned = (np.abs(difference[:, 3]) > _ANGLE) & (tilt < np.pi - 0.05)
    wrong[rows] = (off[rows] > _LENGTH) | turned | (np.abs(tilt - attempts.tilt[rows]) > _ANGLE)
    yield from _first_bad(
        wrong, off * 1e3,
        "has a displacement or tilt that does not follow from its poses before and after ({:.2f} mm off)",
    )  # fmt: skip


def _depth_problems(attempts: Attempts, info: ShardInfo) -> Iterator[str]:
    # One image at a time, because all of them as floats take four times the memory.
    farthest = _farthest(info, attempts.depth.shape[1:])
    unseen, far, near = (np.zeros(len(attempts)) for _ in range(3))
    for row, image in enumerate(attempts.depth):
        seen = image > 0
        unseen[row] = not seen.any()
        beyond = image * DEPTH_UNIT - farthest
        far[row] = max(0.0, float(beyond.max()))
        near[row] = float(image[seen].min()) * DEPTH_UNIT if seen.any() else np.inf
    yield from _first_bad(unseen > 0, unseen, "has a depth image without one valid pixel")
    yield from _first_bad(
        far > BELOW_TABLE, far * 1e3, "has depths up to {:.0f} mm below the table; is its unit 0.1 mm?"
    )
    yield from _first_bad(
        near < NEAREST, near, f"has depths down to {{:.3f}} m, none is under {NEAREST:g}; is its unit 0.1 mm?"
    )


def _farthest(info: ShardInfo, shape: tuple[int, ...]) -> np.ndarray:
    """Compute the depth (h, w) of the table in every pixel, metres; infinite where a ray misses it."""
    rays = pixel_rays(shape, info.intrinsics)
    down = rays @ quat_to_matrix(np.asarray(info.T_base_camera.quat_wxyz, dtype=np.float64))[2]
    with np.errstate(divide="ignore"):
        depth = (info.table_z - float(info.T_base_camera.position[2])) / down
    return np.where(down < 0, depth, np.inf)


def _poses(vectors: np.ndarray) -> Pose:
    return Pose.from_vector(vectors.astype(np.float64))


def _apart(one: Pose, other: Pose) -> tuple[np.ndarray, np.ndarray]:
    length = np.linalg.norm(one.position - other.position, axis=1)
    rotation = quat_multiply(one.quat_wxyz, quat_conjugate(other.quat_wxyz))
    return length, 2 * np.arctan2(np.linalg.norm(rotation[:, 1:], axis=1), np.abs(rotation[:, 0]))


def _outside(x: np.ndarray, y: np.ndarray, info: ShardInfo) -> np.ndarray:
    """Compute the distance (n,) of points outside the region, metres; negative inside."""
    x_min, x_max, y_min, y_max = info.region
    return np.max([x_min - x, x - x_max, y_min - y, y - y_max], axis=0)


def _first_bad(bad: np.ndarray, values: np.ndarray, sentence: str) -> Iterator[str]:
    """Describe the first bad attempt, and count all."""
    rows = np.flatnonzero(bad)
    if len(rows):
        more = f" ({len(rows)} such attempts)" if len(rows) > 1 else ""
        yield f"attempt {rows[0]} {sentence.format(float(values[rows[0]]))}{more}"
