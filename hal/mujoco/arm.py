"""The Panda simulated in MuJoCo: follows joint and straight-line motions."""

from __future__ import annotations

import math
import time

import numpy as np
from scipy.interpolate import CubicSpline

from hal.arm import Arm, ArmState, GraspOutcome
from hal.errors import MotionAborted, OutOfWorkspace
from hal.limits import ArmLimits
from hal.mujoco.world import MujocoWorld
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from mskgrasp.core.grasp import MAX_OPENING, MIN_GAP
from mskgrasp.core.minimum_jerk import minimum_jerk_duration, minimum_jerk_steps
from mskgrasp.core.panda_kinematics import POSE_TOLERANCE, forward_pose, reachable, track, within_limits

JOINT_SPEED = 2.0
"""Greatest joint speed, rad/s (Panda datasheet: 2.175 rad/s for joints 1 to 4)."""
JOINT_ACCELERATION = 5.0
"""Greatest acceleration of a joint, or of the hand's turn, rad/s^2 (Panda datasheet: 7.5 for joint 2)."""
PEAK_ACCELERATION = 1.5
"""Greatest acceleration of the hand on straight lines, m/s^2, as in the SAPIEN cell."""
TURN_SPEED = 1.0
"""Greatest turning speed of the hand on a straight motion, rad/s."""
_WAYPOINT_M, _WAYPOINT_RAD = 0.01, 0.05


class MujocoArm(Arm):
    """The Panda of a `MujocoWorld`; a contact force over the reflex limit ends a motion."""

    simulated = True

    def __init__(self, world: MujocoWorld, limits: ArmLimits):
        super().__init__(limits)
        self._world = world
        self._open = False

    def connect(self) -> None:
        """Build the world unless the camera has built it."""
        if not self._open:
            self._world.open()
            self._open = True

    def close(self) -> None:
        """Free the world unless the camera still uses it."""
        if self._open:
            self._open = False
            self._world.close()

    def _connected(self) -> bool:
        return self._open

    def _state(self) -> ArmState:
        simulation = self._world.simulation
        joints = simulation.joints
        return ArmState(
            joints=joints,
            T_base_tcp=forward_pose(joints),
            gripper_width=simulation.width,
            timestamp_s=time.monotonic(),
        )

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        way = joints - self._world.simulation.target
        seconds = minimum_jerk_duration(float(np.abs(way).max()), speed * JOINT_SPEED, JOINT_ACCELERATION)
        shares = self._shares(seconds)[:, None]
        self._follow(self._world.simulation.target + shares * way)

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        start = self._world.simulation.target
        here = forward_pose(start)
        distance, angle = pose_distance(here, T_base_tcp)
        seconds = max(
            minimum_jerk_duration(distance, speed, PEAK_ACCELERATION),
            minimum_jerk_duration(angle, TURN_SPEED, JOINT_ACCELERATION),
        )
        n = max(2, math.ceil(distance / _WAYPOINT_M), math.ceil(angle / _WAYPOINT_RAD))
        line = straight_line(here, T_base_tcp, np.linspace(0, 1, n + 1)[1:])
        joints, error = track(line.as_matrix(), start)
        if error.max() > POSE_TOLERANCE or not within_limits(
            joints, self.limits.joint_lower, self.limits.joint_upper
        ):
            target = ", ".join(f"{value:.3f}" for value in T_base_tcp.position)
            raise OutOfWorkspace(f"no straight line from here to TCP ({target}) m within the joint limits")
        waypoints = CubicSpline(np.linspace(0, 1, n + 1), np.vstack([start, joints]))
        self._follow(waypoints(self._shares(seconds)))

    def _shares(self, seconds: float) -> np.ndarray:
        """(steps + 1,) shares of a path, from 0 to 1."""
        n_steps = max(2, self._world.simulation.n_steps(seconds))
        return np.concatenate([[0.0], minimum_jerk_steps(n_steps)])

    def _follow(self, joints: np.ndarray) -> None:
        if not self._world.simulation.follow(joints, stop=self._stop.is_set):
            limit = self._world.physics.reflex_force
            raise MotionAborted(
                f"contact force over {limit:.0f} N: the arm stopped; call recover() when it is safe"
            )

    def _move_gripper(self, width: float) -> None:
        self._world.simulation.move_fingers(width, force=None, stop=self._stop.is_set)

    def _grasp(self, force: float) -> GraspOutcome:
        simulation = self._world.simulation
        simulation.move_fingers(-MAX_OPENING, force=force, stop=self._stop.is_set)
        return GraspOutcome(width=simulation.width, holding=simulation.width > MIN_GAP)

    def _wait(self, seconds: float) -> None:
        self._world.simulation.stand(seconds, stop=self._stop.is_set)

    def _forward(self, joints: np.ndarray) -> Pose:
        return forward_pose(joints)

    def _reachable(self, T_base_tcp: Pose) -> bool:
        return reachable(T_base_tcp, self.limits.joint_lower, self.limits.joint_upper)

    def _halt(self) -> None:
        """The arm holds its last target; a motion in progress sees the stop flag."""

    def _recover(self) -> None:
        self._world.simulation.halt()
