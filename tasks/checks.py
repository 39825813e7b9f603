"""Checks of what a user gives the task: its region, options of a reset, poses and grasps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from torch import Tensor

from mskgrasp.core.errors import BadConfig
from mskgrasp.core.settings import Overhead, Region
from mskgrasp.parts import Part
from tasks.scene.camera import NEAR

_OPTIONS = ("parts", "reconfigure", "pose_base_obj", "env_idx", "reset_to_env_states")
_UNIT = 1e-3
"""Greatest difference of a quaternion's length from 1."""


def check_region(overhead: Overhead, region: Region) -> None:
    """Check that the camera sees all of a region.

    Raises:
        BadConfig: It does not, or the region is empty.
    """
    try:
        overhead.check_sees(region)
    except ValueError as error:
        raise BadConfig(f"{error}; choose a smaller region, or a higher camera") from error


def check_tops(overhead: Overhead, parts: Iterable[Part]) -> None:
    """Check that a part is seen however it stands.

    Raises:
        BadConfig: The camera is nearer to its top than `NEAR`, and would see through it.
    """
    for part in parts:
        least = NEAR + part.longest_axis
        if overhead.height < least:
            raise BadConfig(
                f"camera.height {overhead.height:g} is too low for {part.name}, of up to "
                f"{part.longest_axis:.3f} m: at least {least:.2f}"
            )


def check_reset(options: dict) -> None:
    """Check the names of the options of a reset.

    Raises:
        BadConfig: One is unknown, or other parts are named without reconfigure.
    """
    unknown = sorted(options.keys() - set(_OPTIONS))
    if unknown:
        raise BadConfig(f"options: no {', '.join(unknown)}; legal: {', '.join(_OPTIONS)}")
    if options.get("parts") and not options.get("reconfigure"):
        raise BadConfig("options: other parts are loaded with reconfigure=True alone; add it")


def poses_of(given: object, n: int) -> np.ndarray:
    """Poses of n parts (n, 7), x y z qw qx qy qz, of an option of a reset.

    Raises:
        BadConfig: Their shape is another, a number is not finite, or a quaternion's length is not 1.
    """
    poses = np.asarray(given, dtype=np.float64)
    if n == 1 and poses.shape == (7,):
        poses = poses[None]
    if poses.shape != (n, 7) or not np.isfinite(poses).all():
        raise BadConfig(
            f"pose_base_obj: {n} finite poses x y z qw qx qy qz are needed, got an array {poses.shape}"
        )
    lengths = np.linalg.norm(poses[:, 3:], axis=1)
    if (np.abs(lengths - 1) > _UNIT).any():
        raise BadConfig(f"pose_base_obj: quaternions must have length 1, got {lengths.round(4).tolist()}")
    return poses


def grasps_of(action: Tensor, n: int) -> Tensor:
    """Grasps (n, 4) of an action, x y z theta, one a sub-scene.

    Raises:
        BadConfig: Its shape is another.
    """
    if action.shape == (4,) and n == 1:
        return action[None]
    if action.shape != (n, 4):
        raise BadConfig(f"an action in mode grasp is ({n}, 4), x y z theta; got {tuple(action.shape)}")
    return action
