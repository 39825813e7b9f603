"""The Panda simulated in MuJoCo: follows joint and straight-line motions."""

from __future__ import annotations

import time

import numpy as np
from scipy.interpolate import CubicSpline

from hal.arm_state import ArmState, GraspOutcome
from hal.mujoco.world import MujocoWorld
from hal.simulated import SimulatedArm, contact_fault, joint_motion_s
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.minimum_jerk import minimum_jerk_steps
from mskgrasp.core.panda_kinematics import forward_pose, track


class MujocoArm(SimulatedArm[MujocoWorld]):
    """The Panda of a `MujocoWorld`; a contact force over the reflex limit ends a motion."""

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
        shares = self._shares(joint_motion_s(float(np.abs(way).max()), speed))[:, None]
        self._follow(self._world.simulation.target + shares * way)

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self._follow(self._straight(T_base_tcp, speed))

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        simulation = self._world.simulation
        joints = self._straight(T_base_tcp, speed)
        if simulation.follow(joints, stop=self._stop.is_set, limit=force):
            return None
        met = forward_pose(simulation.joints)
        simulation.halt()  # it no longer presses
        return met

    def _straight(self, T_base_tcp: Pose, speed: float) -> np.ndarray:
        """Joints (steps + 1, 7) of the straight line to a pose."""
        start = self._world.simulation.target
        line, seconds = self._line(forward_pose(start), T_base_tcp, speed)
        joints, error = track(line.as_matrix(), start)
        self._check_tracked(joints, float(error.max()), T_base_tcp)
        waypoints = CubicSpline(np.linspace(0, 1, len(joints) + 1), np.vstack([start, joints]))
        return waypoints(self._shares(seconds))

    def _shares(self, seconds: float) -> np.ndarray:
        """(steps + 1,) shares of a path, from 0 to 1."""
        n_steps = max(2, self._world.simulation.n_steps(seconds))
        return np.concatenate([[0.0], minimum_jerk_steps(n_steps)])

    def _follow(self, joints: np.ndarray) -> None:
        if not self._world.simulation.follow(joints, stop=self._stop.is_set):
            raise contact_fault(self._world.physics.reflex_force)

    def _move_gripper(self, width: float) -> None:
        self._world.simulation.move_fingers(width, force=None, stop=self._stop.is_set)

    def _grasp(self, force: float) -> GraspOutcome:
        simulation = self._world.simulation
        simulation.move_fingers(-MAX_OPENING, force=force, stop=self._stop.is_set)
        state = self._state()
        return GraspOutcome(width=state.gripper_width, holding=self.holds(state))

    def _wait(self, seconds: float) -> None:
        self._world.simulation.stand(seconds, stop=self._stop.is_set)

    def _recover(self) -> None:
        self._world.simulation.halt()
