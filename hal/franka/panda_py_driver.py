"""Driver on panda_py; runs in a driver's process."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait

import numpy as np

from hal.errors import CommunicationLost
from hal.franka.driver import MODES, DriverSettings, DriverState, felt_force
from hal.franka.faults import explain, opening_hand
from hal.franka.path import JointPath

_PERIOD_S = 1e-3
_POLL_S = 0.02
_OWED_S = 0.5
_SILENCE_S = 2.0
_CORRECTION_HZ = 4.0
"""Rate of the correction at the goal, 1/s: slow against the arm's own time constant."""
_MAX_CORRECTION = 0.05
"""Greatest correction at the goal, radians: friction and gravity need less, a blocked arm more."""
_ARRIVED = 1e-3


class RobotSilent(RuntimeError):
    """The robot no longer answers."""


class PandaPyDriver:
    """Driver with panda_py's joint impedance controller, whose goal follows the path.

    The controller runs in C++ at 1 kHz; a late target here makes the arm lag, not stumble. It has no
    integral part and friction leaves an error (panda-py issue 49), so the goal is shifted slowly until the
    arm is at the goal. ``Panda.move_to_pose`` is not used: Cartesian impedance is off by millimetres.
    """

    def __init__(self) -> None:
        import panda_py
        import panda_py.controllers
        import panda_py.libfranka

        self._panda_py = panda_py
        self._stopped = threading.Event()
        self._moving = False
        # libfranka refuses a read while a controller starts or ends.
        self._use = threading.Lock()
        self._abandoned: list[Future[bool]] = []

    def connect(self, settings: DriverSettings) -> None:
        """Open robot and gripper; nothing moves."""
        libfranka = self._panda_py.libfranka
        config = libfranka.RealtimeConfig.kEnforce if settings.realtime else libfranka.RealtimeConfig.kIgnore
        self._settings = settings
        self._panda = self._panda_py.Panda(settings.host, realtime_config=config)
        self._robot = self._panda.get_robot()
        self._limited = False
        # A robot refuses thresholds in any other mode, and could not be recovered without a connection.
        if MODES[int(self._robot.read_once().robot_mode)] == "idle":
            self._limit_contacts()
        with opening_hand(settings.host):
            self._gripper = libfranka.Gripper(settings.host)

    def _limit_contacts(self) -> None:
        torque, force = self._settings.contact_torque, [self._settings.contact_force] * 6
        self._robot.set_collision_behavior(torque, torque, force, force)
        self._limited = True

    def state(self) -> DriverState:
        """Measure; may be called during a motion."""
        # After a motion get_state() returns its last sample for ever; during one the link is taken.
        with self._use:
            robot = self._panda.get_state() if self._moving else self._robot.read_once()
        gripper = self._gripper.read_once()
        return DriverState(
            joints=list(robot.q),
            o_t_ee=list(robot.O_T_EE),
            f_t_ee=list(robot.F_T_EE),
            width=gripper.width,
            max_width=gripper.max_width,
            grasped=bool(gripper.is_grasped),
            ee_mass=robot.m_ee,
            ee_centre=list(robot.F_x_Cee),
            load_mass=robot.m_load,
            mode=MODES[int(robot.robot_mode)],
            errors=str(robot.current_errors),
            seconds=time.monotonic(),
        )

    def move_straight(
        self, path: JointPath, T_base_tcp: np.ndarray, until_force: float | None = None
    ) -> list[float] | None:
        """Follow a path along a straight line; the pose is that of its end.

        Returns:
            (16,) ``o_t_ee`` at an external force over ``until_force``, N; None at the pose.
        """
        return self._follow(path, until_force)

    def move_joints(self, path: JointPath) -> None:
        """Follow a path, then correct the error that friction leaves."""
        self._follow(path, None)

    def _follow(self, path: JointPath, until_force: float | None) -> list[float] | None:
        self._check()
        controller = self._panda_py.controllers.JointPosition(
            np.array(self._settings.stiffness), np.array(self._settings.damping)
        )
        wanted = path.curve()
        speed = wanted.derivative()
        with self._use:
            if not self._limited:
                self._limit_contacts()
            at_start = list(self._robot.read_once().O_F_ext_hat_K)
            self._panda.start_controller(controller)
            self._moving = True
        self._ticks = (0.0, time.monotonic())
        met: list[float] | None = None
        try:
            # The robot's own clock, which runs on while this process pauses.
            while (now := controller.get_time()) < path.duration_s:
                self._check()
                self._check_clock(now)
                if until_force is not None:
                    state = self._panda.get_state()
                    if felt_force(state.O_F_ext_hat_K, at_start) > until_force:
                        met = list(state.O_T_EE)
                        # Standing here, the soft controller no longer presses.
                        self._settle(controller, np.array(state.q))
                        break
                controller.set_control(wanted(now), speed(now))
                time.sleep(_PERIOD_S)
            else:
                self._settle(controller, path.joints[-1])
        except RobotSilent:
            raise  # a stop command to a robot that is gone blocks for ever
        except BaseException:
            self._end()
            raise
        self._end()
        self._raise_error()
        return met

    def _settle(self, controller, goal: np.ndarray) -> None:
        correction, still = np.zeros(7), np.zeros(7)
        begin = last = time.monotonic()
        while (now := time.monotonic()) - begin < self._settings.settle_s:
            self._check()
            self._check_clock(controller.get_time())
            state = self._panda.get_state()
            error = goal - np.array(state.q)
            if np.abs(error).max() < _ARRIVED and np.abs(state.dq).max() < 0.01:
                return
            correction = np.clip(
                correction + _CORRECTION_HZ * (now - last) * error, -_MAX_CORRECTION, _MAX_CORRECTION
            )
            last = now
            controller.set_control(goal + correction, still)
            time.sleep(_PERIOD_S)

    def _end(self) -> None:
        """Join the control loop; without it is_moving() stays true and states stay old."""
        with self._use:
            self._panda.stop_controller()
            self._moving = False

    def _raise_error(self) -> None:
        """A reflex or a lost link ends the control loop; panda_py keeps the reason until then."""
        try:
            self._panda.raise_error()
        except RuntimeError as error:
            fault = explain(error, "panda_py", self._settings.host)
            if isinstance(fault, CommunicationLost):
                raise RobotSilent(str(error)) from error
            raise

    def _check_clock(self, now: float) -> None:
        """Detect a lost link by the robot's clock, before libfranka reports it."""
        seen, when = self._ticks
        if now > seen:
            self._ticks = (now, time.monotonic())
        elif time.monotonic() - when > _SILENCE_S:
            raise RobotSilent(f"no state from the robot for {_SILENCE_S:g} s: timeout")

    def _check(self) -> None:
        self._raise_error()
        if self._stopped.is_set():
            raise RuntimeError("Move command preempted!")

    def home_gripper(self) -> bool:
        """Open and close the fingers to find their greatest width."""
        return self._wait(self._gripper.homing)

    def move_gripper(self, width: float, speed: float) -> bool:
        """Move the pads to a width in metres, at a speed in m/s."""
        return self._wait(lambda: self._gripper.move(width, speed))

    def grasp(self, speed: float, force: float) -> bool:
        """Close with a force in N until the pads hold something or meet, at any width."""
        return self._wait(
            lambda: self._gripper.grasp(0.0, speed, force, epsilon_inner=0.08, epsilon_outer=0.08)
        )

    def set_load(self, mass: float, centre: Sequence[float], inertia: Sequence[float]) -> None:
        """State the part in the hand, its centre (3,) and inertia (9,) in the flange; mass 0 for none."""
        with self._use:
            self._robot.set_load(mass, centre, inertia)

    def stop(self) -> None:
        """End a motion of arm and fingers, and any to come before `recover`."""
        self._stopped.set()

    def recover(self) -> bool:
        """Acknowledge the robot's errors, and a stop; False where the gripper has not answered yet."""
        self._stopped.clear()
        # What ended the control loop after `stop` had ended the motion: the next one would report it.
        with contextlib.suppress(RuntimeError):
            self._panda.raise_error()
        with self._use:
            if MODES[int(self._robot.read_once().robot_mode)] == "reflex":
                self._robot.automatic_error_recovery()
        answered = not wait(self._abandoned, _OWED_S).not_done
        if answered:
            self._abandoned.clear()
        return answered

    def _wait(self, command: Callable[[], bool]) -> bool:
        """Run a command of the gripper until it ends or `stop` is called."""
        if self._stopped.is_set():
            return False
        result: Future[bool] = Future()

        def run() -> None:
            try:
                result.set_result(command())
            except BaseException as error:
                result.set_exception(error)

        threading.Thread(target=run, daemon=True).start()
        while True:
            try:
                return result.result(_POLL_S)
            except TimeoutError:
                if self._stopped.is_set():
                    self._abandoned.append(result)
                    self._gripper.stop()
                    return False
