"""Grasps in NVIDIA's ``isaac_grasp`` format, a YAML file of hand poses in a part's frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose, quat_about_z, quat_to_matrix, wrap_half_turn
from mskgrasp.core.grasp import MAX_OPENING, lowest_grasp_z, pose_base_tcp
from mskgrasp.core.panda_kinematics import TCP_OFFSET
from mskgrasp.parts import Part
from mskgrasp.planning.certified import SIMULATED_ALIKE, CertifiedGrasps

MOST_BYTES = 2**24
"""Largest file that is read."""
MOST_TILT = float(np.radians(5.0))
"""Greatest angle between the approach of a grasp that counts as top-down and the vertical, radians."""
_ROUNDING = 1e-4
"""A grasp may be lower than the lowest by this much, metres: files are rounded."""
_TCP_IN_LINK = {"panda_hand": TCP_OFFSET, "panda_hand_tcp": 0.0}
"""Distance of the TCP along z of the links that a file may give poses of, metres."""


def write_isaac_grasp(path: Path, part: Part, certified: CertifiedGrasps) -> None:
    """Write certified grasps as poses of ``panda_hand`` in the frame of the part's mesh.

    Each grasp holds for the resting pose that its name ends in, and is written for every pose that looks like
    that one, too. Beside the fields of the format (version 1.0) it has ``displacement`` and
    ``displacement_cov``, which readers of the format ignore: the expected motion of the part in the hand, and
    its covariance where the part's pose is seen as well as the grasp was certified for, metres and radians
    along the axes that ``displacement_axes`` names: those of the grasp frame, whose y and z are the hand's
    reversed.

    Raises:
        OSError: The disk is full or not writable.
    """
    T_tcp_hand = Pose.translation(np.array([0.0, 0.0, -TCP_OFFSET]))
    errors = certified.conditions["pose_errors"]
    pose_cov = np.diag(np.square([errors["position"], errors["position"], errors["turn"]]))
    grasps = {}
    for number, one in enumerate(certified.grasps):
        covariance = one.covariance(pose_cov) + SIMULATED_ALIKE
        alike = {other: turn for other, (first, turn) in certified.like.items() if first == one.resting}
        for resting, turn in {one.resting: 0.0, **alike}.items():
            T_rest_like = Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.asarray(turn)))
            hand = part.resting[resting].inverse() @ T_rest_like @ pose_base_tcp(one.grasp) @ T_tcp_hand
            w, *xyz = (float(value) for value in hand.quat_wxyz)
            grasps[f"grasp_{number}_pose_{resting}"] = dict(
                confidence=round(one.expected_share, 4),
                position=[float(value) for value in hand.position],
                orientation=dict(w=w, xyz=xyz),
                cspace_position=dict(panda_finger_joint1=0.0),
                pregrasp_cspace_position=dict(panda_finger_joint1=MAX_OPENING / 2),
                displacement=[float(value) for value in one.mean],
                displacement_cov=covariance.tolist(),
            )
    values = dict(
        format="isaac_grasp",
        format_version=1.0,
        object_frame_link=part.name,
        gripper_frame_link="panda_hand",
        displacement_axes="x, -y, -z of panda_hand before the grasp; turn about -z",
        grasps=grasps,
    )
    write_whole(path, yaml.safe_dump(values, sort_keys=False).encode())


@dataclass(frozen=True, kw_only=True)
class IsaacGrasps:
    """Grasps of a file in the format.

    Attributes:
        values: Contents of the file.
        T_mesh_tcp: Poses of the TCP in the part's frame of the file, by the grasp's name.
    """

    values: dict[str, Any]
    T_mesh_tcp: dict[str, Pose]


@dataclass(frozen=True, kw_only=True)
class TopDownGrasp:
    """A grasp of a file that is top-down in a resting pose of the part.

    Attributes:
        resting: Index of the resting pose.
        grasp: (4,) x y z theta in its rest frame, metres over the table and radians.
        sign: -1 where the axes of this grasp are those of the hand in the file turned by half a turn, else 1.
        tilt: Angle between the approach and the vertical, radians.
    """

    resting: int
    grasp: np.ndarray
    sign: float
    tilt: float


def read_isaac_grasp(path: Path) -> IsaacGrasps:
    """Read a file of grasps of ``panda_hand``, or of its ``panda_hand_tcp``.

    Raises:
        BadConfig: The file is missing or not of the format, or its grasps are of another hand.
    """
    values = read_yaml(path, MOST_BYTES)
    if values.get("format") != "isaac_grasp":
        raise BadConfig(f"{path}: format is {values.get('format')!r}, legal: 'isaac_grasp'")
    if values.get("format_version", 1.0) != 1.0:
        raise BadConfig(f"{path}: format_version is {values['format_version']!r}, legal: 1.0")
    link = values.get("gripper_frame_link")
    if not isinstance(link, str) or link not in _TCP_IN_LINK:
        raise BadConfig(
            f"{path}: gripper_frame_link is {link!r}, legal: {', '.join(_TCP_IN_LINK)}, the only known hand"
        )
    T_link_tcp = Pose.translation(np.array([0.0, 0.0, _TCP_IN_LINK[link]]))
    found = {}
    grasps = values.get("grasps")
    if not isinstance(grasps, dict) or not grasps:
        raise BadConfig(f"{path} holds no grasps")
    for name, one in grasps.items():
        try:
            if not isinstance(one["orientation"]["xyz"], list):
                raise TypeError("xyz is no list")
            position = np.array(one["position"], dtype=np.float64).reshape(3)
            quat = np.array([one["orientation"]["w"], *one["orientation"]["xyz"]], dtype=np.float64).reshape(
                4
            )
            # Not "> 0.01", which NaN is not either.
            if not np.isfinite(position).all() or not abs(np.linalg.norm(quat) - 1) <= 0.01:
                raise ValueError("position or orientation is not finite, or no rotation")
        except (LookupError, TypeError, ValueError, OverflowError) as error:
            raise BadConfig(f"{path}: grasp {name!r} has no pose: {' '.join(str(error).split())}") from error
        if str(name) in found:  # 1 and '1' are two keys of YAML
            raise BadConfig(f"{path}: two grasps are called {name}; rename one")
        found[str(name)] = Pose(position=position, quat_wxyz=quat / np.linalg.norm(quat)) @ T_link_tcp
    return IsaacGrasps(values=values, T_mesh_tcp=found)


def top_down_grasp(part: Part, T_obj_tcp: Pose, stands: Sequence[bool] | None = None) -> TopDownGrasp | None:
    """The most vertical of a grasp's directions in the part's resting poses.

    Args:
        part: The part.
        T_obj_tcp: Pose of the TCP in the part's frame.
        stands: Of each resting pose, whether it counts; None: all do.

    Returns:
        The grasp; None where in each pose it is tilted by more than `MOST_TILT`, or its pads touch the table.
    """
    found = []
    for number in range(len(part.resting_probability)):
        if stands is not None and not stands[number]:
            continue
        T_table_tcp = part.resting[number] @ T_obj_tcp
        axes = quat_to_matrix(np.asarray(T_table_tcp.quat_wxyz))
        tilt = float(np.arccos(np.clip(-axes[2, 2], -1.0, 1.0)))
        if tilt <= MOST_TILT and T_table_tcp.position[2] >= lowest_grasp_z(0.0) - _ROUNDING:
            # The tcp's x is that of the grasp frame.
            theta = float(np.arctan2(axes[1, 0], axes[0, 0]))
            wrapped = float(wrap_half_turn(theta))
            grasp = np.array([*T_table_tcp.position, wrapped])
            sign = 1.0 if np.cos(theta - wrapped) > 0 else -1.0
            found.append(TopDownGrasp(resting=number, grasp=grasp, sign=sign, tilt=tilt))
    return min(found, key=lambda one: one.tilt, default=None)


def write_scored(path: Path, read: IsaacGrasps, scores: Mapping[str, Mapping[str, Any]]) -> None:
    """Write the grasps of a file that were scored, with all their fields and those of their scores.

    Args:
        path: The new file.
        read: The file that was read.
        scores: Fields by the grasp's name; the others are left out.

    Raises:
        OSError: The disk is full or not writable.
    """
    grasps = {
        name: dict(one, **scores[str(name)])
        for name, one in read.values["grasps"].items()
        if str(name) in scores
    }
    values = read.values | {"grasps": grasps}
    write_whole(path, yaml.safe_dump(values, sort_keys=False).encode())
