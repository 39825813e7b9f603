"""Grasps in NVIDIA's ``isaac_grasp`` format, a YAML file of hand poses in a part's frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING, pose_base_tcp
from mskgrasp.core.panda_kinematics import TCP_OFFSET
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasps


def write_isaac_grasp(path: Path, part: Part, certified: CertifiedGrasps) -> None:
    """Write certified grasps as poses of ``panda_hand`` in the frame of the part's mesh.

    Each grasp holds for the resting pose that its name ends in. Beside the fields of the format (version 1.0)
    it has ``displacement`` and ``displacement_cov``, which readers of the format ignore: the expected motion
    of the part in the hand, and its covariance, metres and radians along the axes of the grasp.

    Raises:
        OSError: The disk is full or not writable.
    """
    T_tcp_hand = Pose(position=np.array([0.0, 0.0, -TCP_OFFSET]), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
    grasps = {}
    for number, one in enumerate(certified.grasps):
        T_table_obj = Pose(
            position=np.array([0.0, 0.0, part.resting.position[one.resting, 2]]),
            quat_wxyz=part.resting.quat_wxyz[one.resting],
        )
        hand = T_table_obj.inverse() @ pose_base_tcp(one.grasp) @ T_tcp_hand
        w, *xyz = (float(value) for value in hand.quat_wxyz)
        grasps[f"grasp_{number}_pose_{one.resting}"] = dict(
            confidence=round((one.lifted + 1) / (one.n + 2), 4),
            position=[float(value) for value in hand.position],
            orientation=dict(w=w, xyz=xyz),
            cspace_position=dict(panda_finger_joint1=0.0),
            pregrasp_cspace_position=dict(panda_finger_joint1=MAX_OPENING / 2),
            displacement=[float(value) for value in one.mean],
            displacement_cov=one.residual.tolist(),
        )
    values = dict(
        format="isaac_grasp",
        format_version=1.0,
        object_frame_link=part.name,
        gripper_frame_link="panda_hand",
        grasps=grasps,
    )
    write_whole(path, yaml.safe_dump(values, sort_keys=False).encode())
