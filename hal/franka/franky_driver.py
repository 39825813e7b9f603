"""Driver on franky; runs in a driver's process."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from hal.franka.driver import MODES, DriverSettings, DriverState, column_major, felt_force
from hal.franka.faults import opening_hand
from hal.franka.frames import tool_along
from hal.franka.path import JointPath, Peaks

if TYPE_CHECKING:
    import franky

_POLL_S = 0.02
_OWED_S = 0.5
_TOUCH_POLL_S = 0.002
"""Time between two readings of the force in a motion that a contact ends, s."""
_LEAST_SHARE, _LEAST_WAY = 0.05, 1e-3
"""A joint with less than this share of the longest way, or less than this way, rad, gets its limits.

Too low for what is left of a motion before, a limit would make the motion take many times its duration.
"""
_RAD_PER_M, _M_PER_RAD = 0.5, 0.1
"""The same for the turn of a straight motion against its shift, and for the shift against the turn."""
_FRAME_S, _FILTER_S = 5.0, 0.3
"""Time the robot has to report a turned frame, s, and time after which filtered speeds forget the turn, s."""
_SAME_FRAME = 1e-9
_NEAR_RAD = 0.05
"""Desired and measured orientation of an arm at rest differ by less, rad."""


class FrankyDriver:
    """Driver with the robot's own joint position control, which leaves no lasting error."""

    def __init__(self) -> None:
        import franky

        self._franky = franky
        self._stopped = threading.Event()
        self._abandoned: list[franky.BoolFuture] = []

    def connect(self, settings: DriverSettings) -> None:
        """Open robot and gripper; nothing moves."""
        franky = self._franky
        config = franky.RealtimeConfig.Enforce if settings.realtime else franky.RealtimeConfig.Ignore
        self._robot = franky.Robot(settings.host, realtime_config=config)
        self._robot.set_collision_behavior(settings.contact_torque, settings.contact_force)
        with opening_hand(settings.host):
            self._gripper = franky.Gripper(settings.host)

    def state(self) -> DriverState:
        """Measure; may be called during a motion."""
        robot, gripper = self._fresh_state(), self._gripper.state
        # Independent of a tool that a straight motion has turned.
        o_t_ee = robot.O_T_EE.matrix @ np.linalg.inv(robot.NE_T_EE.matrix)
        return DriverState(
            joints=[float(value) for value in robot.q],
            o_t_ee=column_major(o_t_ee),
            f_t_ee=column_major(robot.F_T_NE.matrix),
            width=gripper.width,
            max_width=gripper.max_width,
            grasped=bool(gripper.is_grasped),
            ee_mass=float(robot.m_ee),
            ee_centre=[float(value) for value in robot.F_x_Cee],
            load_mass=float(robot.m_load),
            mode=MODES[int(robot.robot_mode)],
            errors=str(robot.current_errors),
            seconds=time.monotonic(),
        )

    def _fresh_state(self) -> franky.RobotState:
        robot = self._robot.state
        if not self._robot.is_in_control:
            # The first of the waiting states is from before this call; the one after it is not.
            robot = self._robot.state
        return robot

    def move_joints(self, path: JointPath) -> None:
        """Move to the end of a path by one motion.

        With limits in proportion to their ways all joints have the same profile: a straight line in their
        space, whose speed, acceleration and jerk are no greater than those of the path.
        """
        goal = path.joints[-1]
        way = np.abs(goal - self._fresh_state().q_d)
        limits = Peaks.of(np.maximum(way, max(_LEAST_SHARE * way.max(), _LEAST_WAY)), path.duration_s)
        robot = self._robot
        for limit, peak in (
            (robot.joint_velocity_limit, limits.speed),
            (robot.joint_acceleration_limit, limits.acceleration),
            (robot.joint_jerk_limit, limits.jerk),
        ):
            limit.set(np.minimum(peak, limit.max))
        self._run(self._franky.JointMotion(goal))

    def move_straight(
        self, path: JointPath, T_base_tcp: np.ndarray, until_force: float | None = None
    ) -> list[float] | None:
        """Move the TCP straight to a pose (4, 4) by one motion of the path's duration and peaks.

        franky gives each axis of the end effector's frame at the start its own profile under the same limits,
        so that the TCP leaves a line between the axes by millimetres: the frame is turned onto the line.
        The parts of a turn along the line and across it keep profiles of their own: with both the hand tilts
        by milliradians on the way.

        Returns:
            (16,) ``o_t_ee`` at an external force over ``until_force``, N; None at the pose.
        """
        state = self._fresh_state()
        tool = tool_along(state.O_T_EE_d.matrix @ np.linalg.inv(state.NE_T_EE.matrix), T_base_tcp)
        self._turn_tool(tool)
        try:
            met = self._run(self._straight_motion(T_base_tcp @ tool, path.duration_s), until_force)
        except self._franky.NetworkException:
            raise  # a command to a robot that is gone blocks for ever
        except BaseException:
            self._turn_tool_back()
            raise
        self._turn_tool_back()
        return met

    def _straight_motion(self, goal: np.ndarray, seconds: float) -> franky.CartesianMotion:
        start = self._fresh_state().O_T_EE_d.matrix
        way = float(np.linalg.norm(goal[:3, 3] - start[:3, 3]))
        angle = float(Rotation.from_matrix(start[:3, :3].T @ goal[:3, :3]).magnitude())
        shift = Peaks.of(np.array(max(way, _M_PER_RAD * angle, _LEAST_WAY)), seconds)
        turn = Peaks.of(np.array(max(angle, _RAD_PER_M * way, _LEAST_WAY)), seconds)
        robot = self._robot
        for limit, peak in (
            (robot.translation_velocity_limit, shift.speed),
            (robot.translation_acceleration_limit, shift.acceleration),
            (robot.translation_jerk_limit, shift.jerk),
            (robot.rotation_velocity_limit, turn.speed),
            (robot.rotation_acceleration_limit, turn.acceleration),
            (robot.rotation_jerk_limit, turn.jerk),
        ):
            limit.set(min(float(peak), limit.max))
        return self._franky.CartesianMotion(self._franky.Affine(goal))

    def _turn_tool(self, tool: np.ndarray) -> None:
        """Turn the end effector's frame to (4, 4) against that of Desk.

        Raises:
            RuntimeError: The robot did not take it; nothing moves.
        """
        if np.allclose(self._fresh_state().NE_T_EE.matrix, tool, atol=_SAME_FRAME):
            return
        self._robot.set_ee(column_major(tool))
        deadline, seen = time.monotonic() + _FRAME_S, None
        while time.monotonic() < deadline:
            state = self._fresh_state()
            off = Rotation.from_matrix(state.O_T_EE.matrix[:3, :3].T @ state.O_T_EE_d.matrix[:3, :3])
            if np.allclose(state.NE_T_EE.matrix, tool, atol=_SAME_FRAME) and off.magnitude() < _NEAR_RAD:
                seen = seen or state.time
                if state.time.to_sec() - seen.to_sec() > _FILTER_S:
                    return
            time.sleep(_POLL_S)
        raise RuntimeError(f"the robot did not turn its end effector's frame within {_FRAME_S:g} s")

    def _turn_tool_back(self) -> None:
        # States do not depend on it and the next straight motion turns it anyway, so a robot in a fault,
        # which refuses this, may keep it.
        with contextlib.suppress(self._franky.CommandException, RuntimeError):
            self._turn_tool(np.eye(4))

    def _run(
        self,
        motion: franky.BaseJointPositionMotion | franky.BaseCartesianPoseMotion,
        until_force: float | None = None,
    ) -> list[float] | None:
        if self._stopped.is_set():
            raise RuntimeError("Move command preempted!")
        at_start = self._fresh_state().O_F_ext_hat_K
        self._robot.move(motion, asynchronous=True)
        while not self._robot.join_motion(timeout=_POLL_S if until_force is None else _TOUCH_POLL_S):
            if self._stopped.is_set():
                self._stop_motion()
            elif until_force is not None:
                state = self._robot.state
                if felt_force(state.O_F_ext_hat_K, at_start) > until_force:
                    self._end_at_contact()
                    return column_major(state.O_T_EE.matrix @ np.linalg.inv(state.NE_T_EE.matrix))
        return None

    def _end_at_contact(self) -> None:
        """Stop the arm; the end of the motion by this stop is no fault."""
        try:
            self._stop_motion()
            while not self._robot.join_motion(timeout=_POLL_S):
                self._stop_motion()
        except self._franky.ControlException as error:
            if "preempted" not in str(error):
                raise
        if self._stopped.is_set():
            raise RuntimeError("Move command preempted!")

    def _stop_motion(self) -> None:
        # A robot in a reflex refuses to stop. Joining the motion tells whether it is over, and why; without
        # that the next motion would report it.
        with contextlib.suppress(self._franky.CommandException):
            self._robot.stop()

    def home_gripper(self) -> bool:
        """Open and close the fingers to find their greatest width."""
        return self._wait(self._gripper.homing_async)

    def move_gripper(self, width: float, speed: float) -> bool:
        """Move the pads to a width in metres, at a speed in m/s."""
        return self._wait(lambda: self._gripper.move_async(width, speed))

    def grasp(self, speed: float, force: float) -> bool:
        """Close with a force in N until the pads hold something or meet, at any width."""
        return self._wait(
            lambda: self._gripper.grasp_async(0.0, speed, force, epsilon_inner=0.08, epsilon_outer=0.08)
        )

    def set_load(self, mass: float, centre: Sequence[float], inertia: Sequence[float]) -> None:
        """State the part in the hand, its centre (3,) and inertia (9,) in the flange; mass 0 for none."""
        self._robot.set_load(mass, centre, inertia)

    def stop(self) -> None:
        """End a motion of arm and fingers, and any to come before `recover`."""
        self._stopped.set()
        self._robot.stop()

    def recover(self) -> bool:
        """Acknowledge the robot's errors, and a stop; False where the gripper has not answered yet.

        Raises:
            RuntimeError: The robot did not recover.
        """
        self._stopped.clear()
        # A reflex without an error in force is a mode, which has_errors does not see.
        stuck = self._robot.has_errors or MODES[int(self._robot.state.robot_mode)] == "reflex"
        if stuck and not self._robot.recover_from_errors():
            raise RuntimeError("automatic error recovery failed")
        answered = all(result.wait(_OWED_S) for result in self._abandoned)
        if answered:
            self._abandoned.clear()
        return answered

    def _wait(self, start: Callable[[], franky.BoolFuture]) -> bool:
        if self._stopped.is_set():
            return False
        result = start()
        while not result.wait(_POLL_S):
            if self._stopped.is_set():
                # A future that is destroyed waits for its command, which a stopped gripper need not answer.
                self._abandoned.append(result)
                self._gripper.stop()
                return False
        return result.get()
