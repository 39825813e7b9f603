"""Six-axis arm: shoulder and elbow in a plane that turns about the base, and a wrist of three axes.

The arm is simulated, over a table; a real one sends its vendor's commands in the methods with an underscore.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from hal import Arm, ArmLimits, ArmState, GraspOutcome
from hal.errors import OutOfWorkspace
from hal.gripper import FRANKA_HAND
from mskgrasp import Pose
from mskgrasp.core.geometry import pose_distance, straight_line

HAND = replace(FRANKA_HAND, force=(5.0, 40.0), speed=(0.01, 0.1))
"""The networks that ship know the Franka Hand: another hand with its fingers and palm."""
LOWER, UPPER = np.array([-2.8, -0.5, -2.8, 1.2, -1.0, -3.1]), np.array([2.8, 2.2, 0.0, 5.0, 1.0, 3.1])
SHOULDER, LINK, TOOL = 0.4, 0.5, 0.15
"""Height of the shoulder, length of both links, distance of the TCP from the wrist, metres."""
JOINT_SPEED, TICK_S = 2.0, 0.01


def forward(joints: np.ndarray) -> Pose:
    """``T_base_tcp`` at joints (6,), radians."""
    yaw, shoulder, elbow = joints[:3]
    turn = Rotation.from_euler("z", yaw) * Rotation.from_euler("XYZ", joints[3:])
    out = LINK * (math.cos(shoulder) + math.cos(shoulder + elbow))
    up = SHOULDER + LINK * (math.sin(shoulder) + math.sin(shoulder + elbow))
    wrist = np.array([out * math.cos(yaw), out * math.sin(yaw), up])
    return Pose(
        position=wrist + turn.apply([0.0, 0.0, TOOL]),
        quat_wxyz=turn.as_quat(canonical=True, scalar_first=True),
    )


def inverse(T_base_tcp: Pose) -> np.ndarray | None:
    """Joints (6,), radians, that reach a pose within the limits; None if none do."""
    turn = Rotation.from_quat(T_base_tcp.quat_wxyz, scalar_first=True)
    x, y, z = T_base_tcp.position - turn.apply([0.0, 0.0, TOOL])
    out, up, yaw = math.hypot(x, y), z - SHOULDER, math.atan2(y, x)
    bend = (out**2 + up**2) / (2 * LINK**2) - 1
    if abs(bend) > 1:
        return None
    elbow = -math.acos(bend)
    wrist = (Rotation.from_euler("z", -yaw) * turn).as_euler("XYZ")
    wrist[0] %= 2 * math.pi  # a hand that points down has its first wrist joint at pi
    joints = np.array([yaw, math.atan2(up, out) - elbow / 2, elbow, *wrist])
    return joints if ((joints >= LOWER) & (joints <= UPPER)).all() else None


class SixAxisArm(Arm):
    simulated = True

    def __init__(self, limits: ArmLimits, pace: float):
        super().__init__(limits)
        self._pace, self._open = pace, False
        self._joints, self._width = np.array([0.0, 1.7, -2.34, math.pi, 0.0, 0.0]), HAND.stroke

    def connect(self) -> None:
        self._open = True

    def close(self) -> None:
        self._open = False

    def _connected(self) -> bool:
        return self._open

    def _state(self) -> ArmState:
        return ArmState(
            joints=self._joints.copy(),
            T_base_tcp=forward(self._joints),
            gripper_width=self._width,
            timestamp_s=time.monotonic(),
            max_width=HAND.stroke,
        )

    def _forward(self, joints: np.ndarray) -> Pose:
        return forward(joints)

    def _reachable(self, T_base_tcp: Pose) -> bool:
        return inverse(T_base_tcp) is not None

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        start = self._joints
        seconds = np.abs(joints - start).max() / (speed * JOINT_SPEED)
        self._move(seconds, lambda share: self._set_joints(start + share * (joints - start)))

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self._move_straight(T_base_tcp, speed, lambda: False)

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        self._move_straight(T_base_tcp, speed, self._touches)
        return forward(self._joints) if self._touches() else None

    def _touches(self) -> bool:
        return forward(self._joints).position[2] - HAND.pad_reach <= self.limits.table_z

    def _move_straight(self, T_base_tcp: Pose, speed: float, met: Callable[[], bool]) -> None:
        here = forward(self._joints)
        distance, angle = pose_distance(here, T_base_tcp)
        seconds = max(float(distance) / speed, float(angle))
        n = 1 + math.ceil(seconds / TICK_S)
        line = straight_line(here, T_base_tcp, np.linspace(0, 1, n + 1))
        path = [
            inverse(Pose(position=p, quat_wxyz=q)) for p, q in zip(line.position, line.quat_wxyz, strict=True)
        ]
        joints = [one for one in path if one is not None]
        if len(joints) < len(path):  # before anything moves
            raise OutOfWorkspace("no straight line from here to this pose within the joint limits")
        self._move(seconds, lambda share: met() or self._set_joints(joints[round(share * n)]))

    def _move_gripper(self, width: float) -> None:
        start = self._width
        self._move(
            abs(width - start) / HAND.speed[1], lambda share: self._set_width(start + share * (width - start))
        )

    def _grasp(self, force: float) -> GraspOutcome:
        self._move_gripper(0.0)  # nothing is ever between these fingers
        state = self._state()
        return GraspOutcome(width=state.gripper_width, holding=self.holds(state))

    def _wait(self, seconds: float) -> None:
        self._stop.wait(seconds / self._pace)

    def _halt(self) -> None: ...
    def _recover(self) -> None: ...

    def _set_joints(self, joints: np.ndarray) -> None:
        self._joints = joints

    def _set_width(self, width: float) -> None:
        self._width = width

    def _move(self, seconds: float, step: Callable[[float], object]) -> None:
        """Call ``step`` with the share of the motion until it is over, or somebody stops it."""
        n = max(1, math.ceil(seconds / TICK_S))
        for k in range(1, n + 1):
            if self._stop.wait(TICK_S / self._pace):
                return
            step(k / n)
