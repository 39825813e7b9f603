"""One grasp of a known part, simulated again and again under the errors of a real cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from pydantic import Field

from hal.camera import RgbdFrame
from mskgrasp.core.config import Config
from mskgrasp.core.displacement_covariance import half_turned_displacement
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply
from mskgrasp.core.grasp import (
    FAILURES,
    lowest_grasp_z,
    object_displacement,
    pose_base_tcp,
    swing_in_hand,
)
from mskgrasp.core.settings import REGION, TABLE_Z
from mskgrasp.planning.certified import half_turned, rest_frame, to_base, turned
from mskgrasp.simulation.shard import FIELDS, discard_reason
from tasks import GraspDisplacementEnv


class PoseErrors(Config):
    """Standard deviations (normal) of the part's pose as a camera gives it."""

    position: float = Field(default=3e-4, ge=0, le=0.005)
    """Along x and along y, m."""
    height: float = Field(default=2e-4, ge=0, le=0.005)
    """Of the table under the part, m."""
    turn: float = Field(default=5e-3, ge=0, le=0.1)
    """About the vertical, rad."""


@dataclass(frozen=True, kw_only=True)
class Repeat:
    """Outcome of one simulation of a grasp.

    Attributes:
        reason: Reason why the part was not lifted: a failure, or why the attempt says nothing about the
            grasp; empty where it was lifted.
        error: (4,) true pose of the part less its seen one: x, y, z and turn, axes of the grasp, metres and
            radians.
        displacement: (4,) of the part's origin in the hand, from its seen pose; NaN where not lifted.
        swing: (2,) of the part in the hand, radians about x and y of the grasp; NaN likewise.
    """

    reason: str
    error: np.ndarray
    displacement: np.ndarray
    swing: np.ndarray


def place_part(env: GraspDisplacementEnv, which: int, place: np.ndarray, turn: float, seed: int = 0) -> Pose:
    """Begin an episode with the part in one of its resting poses, as the engine holds it.

    Args:
        env: Holds the part.
        which: Index of the resting pose among `tasks.scene.standing.StandingPoses.poses`.
        place: (2,) x and y of the part's origin, base frame, metres.
        turn: About the vertical, radians.
        seed: Determines the errors of execution.

    Returns:
        ``T_base_obj``.
    """
    pose = _at(env, which, place, turn)
    env.begin_episode(seed, np.asarray(pose.as_vector())[None])
    return pose


def captured_frame(env: GraspDisplacementEnv) -> RgbdFrame:
    """The scene as the task's depth camera sees it, without colour."""
    depth = env.capture_depth()[0].cpu().numpy()
    return RgbdFrame(
        colour=np.zeros((*depth.shape, 3), np.uint8),
        depth=depth,
        intrinsics=env.intrinsics,
        T_base_camera=env.T_base_camera,
        timestamp_s=0.0,
        serial="simulated",
    )


def repeat_grasp(
    env: GraspDisplacementEnv,
    which: int,
    grasp: np.ndarray,
    errors: PoseErrors,
    seed: tuple[int, ...],
    *,
    offset: float = 0.0,
) -> Repeat:
    """Simulate a grasp of a part once, at a place and turn of its own, where it is seen with an error.

    Args:
        env: Holds the part; its noise is that of the arm and of what a cell does not know.
        which: As in `place_part`.
        grasp: (4,) x y z theta in the part's rest frame.
        errors: Of the seen pose.
        seed: Determines place, turn and all errors.
        offset: Turn by which the grasp's frame is turned against the rest frame, radians.
    """
    rng = np.random.default_rng(seed)
    x_min, x_max, y_min, y_max = REGION
    middle = np.array([x_min + x_max, y_min + y_max]) / 2
    # In the middle half of the region, where large parts are within it, too.
    place = middle + rng.uniform(-0.25, 0.25, size=2) * [x_max - x_min, y_max - y_min]
    turn = float(rng.uniform(-np.pi, np.pi))
    dx, dy, dz, dturn = rng.normal(size=4) * [errors.position, errors.position, errors.height, errors.turn]
    place_part(env, which, place, turn, seed=int(rng.integers(2**31)))
    seen = _at(env, which, place - [dx, dy], turn - dturn, up=-dz)
    quat_table_obj = env.parts[0].resting.quat_wxyz[env.standing[0].numbers[which]]
    frame = turned(rest_frame(seen, quat_table_obj), offset)
    commanded = to_base(frame, grasp, TABLE_Z - dz)
    commanded[2] = max(commanded[2], lowest_grasp_z(TABLE_Z))
    outcome = env.try_grasp(torch.as_tensor(commanded[None], dtype=torch.float32))
    row = {name: outcome[name][0].cpu().numpy() for name in FIELDS}
    reason = discard_reason(outcome, row) or ("" if row["success"] else FAILURES[int(row["failure"])])
    sign = half_turned(frame, grasp, commanded)
    cos, sin = sign * np.cos(commanded[3]), sign * np.sin(commanded[3])
    error = np.array([cos * dx + sin * dy, -sin * dx + cos * dy, dz, dturn])
    if reason:
        return Repeat(reason=reason, error=error, displacement=np.full(4, np.nan), swing=np.full(2, np.nan))
    before = pose_base_tcp(commanded).inverse() @ seen
    after = Pose.from_vector(row["pose_tcp_obj_after"].astype(np.float64))
    displacement, _ = object_displacement(before, after)
    return Repeat(
        reason="",
        error=error,
        displacement=half_turned_displacement(np.asarray(displacement), sign),
        swing=sign * np.asarray(swing_in_hand(before, after)),
    )


def _at(env: GraspDisplacementEnv, which: int, place: np.ndarray, turn: float, up: float = 0.0) -> Pose:
    standing = env.standing[0].poses
    return Pose(
        position=np.array([*place, standing.position[which, 2] + up]),
        quat_wxyz=quat_multiply(quat_about_z(np.asarray(turn)), standing.quat_wxyz[which]),
    )
