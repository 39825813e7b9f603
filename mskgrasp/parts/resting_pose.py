"""Initial pose of a part: a resting pose at a random position and turn."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, quat_rotate
from mskgrasp.core.settings import Region


def random_resting_pose(
    resting: Pose,
    probability: np.ndarray,
    vertices: np.ndarray,
    region: Region,
    rng: np.random.RandomState,
) -> np.ndarray:
    """Draw a part's pose on the table, entirely inside the region if it fits.

    Args:
        resting: ``T_table_obj`` of its k resting poses.
        probability: (k,) of each.
        vertices: (k, 3) vertices of its hulls, obj frame, metres.
        region: Bounds of the part's position.
        rng: ManiSkill's generator of the episode.

    Returns:
        (7,) ``T_base_obj``: x y z qw qx qy qz. A part larger than the region lies in its middle.
    """
    which = rng.choice(len(probability), p=probability)
    turn = rng.uniform(-np.pi, np.pi)
    unit = rng.uniform(0.0, 1.0, size=2)
    quat_wxyz = quat_multiply(quat_about_z(np.asarray(turn)), resting.quat_wxyz[which])
    footprint = quat_rotate(quat_wxyz, vertices)[:, :2]
    low, high = footprint.min(axis=0), footprint.max(axis=0)
    start = np.array([region[0], region[2]]) - low
    room = np.array([region[1], region[3]]) - high - start
    place = np.where(room > 0, start + unit * room, start + room / 2)
    pose = Pose(position=np.array([*place, resting.position[which, 2]]), quat_wxyz=quat_wxyz)
    return pose.as_vector()
