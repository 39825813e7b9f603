"""Arm backend for a Panda or FR3 with the Franka Hand, on either driver."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from hal.arm import JOINT_TOLERANCE, POSITION_TOLERANCE, ROTATION_TOLERANCE, Arm
from hal.arm_state import ArmState, GraspOutcome
from hal.errors import CommunicationLost, HalError, MotionAborted, NeedsRecovery, OutOfWorkspace, Stopped
from hal.franka.config import JOINT_SPEED, FrankyArmConfig, PandaPyArmConfig
from hal.franka.driver import DriverSettings, DriverState
from hal.franka.faults import NoTrajectory
from hal.franka.frames import check_end_effector, load_in_flange, pose_from_columns
from hal.franka.link import DriverLink
from hal.franka.path import JointPath, joint_path, straight_path
from hal.hand import ConfiguredHand, Load
from hal.limits import ArmLimits
from hal.motion_gate import STOPPED
from mskgrasp.core.geometry import Pose, pose_distance, quat_conjugate, quat_multiply
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import forward_pose, reachable

TURN_SPEED = 1.0
"""Greatest turning speed of the hand on a straight motion, rad/s."""
_GRIPPER_S = 10.0
"""Time limit of homing, and of a gripper command beyond its motion, s."""
_RECOVERY_S = 2.0
"""The robot's mode may lag behind its recovery by this, s."""
_STILL_WIDTH = 1e-4
_NO_SHIFT, _NO_TURN = 1e-3, 0.01
"""Shift and turn under which a motion is only the other, metres and radians."""
_ALIGNED = 0.02
"""Cosine between shift and axis of the turn under which they are across each other; 1 less it: along."""
_STILL_JOINT, _STANDING_S = 1e-4, 0.4
"""An arm whose joints move by less than this angle, rad, in this time, s, is at rest."""
_STILL_ERROR = 0.02
"""An arm that approaches its goal by less than this fraction of the tolerance comes no closer."""
_POLL_S = 0.05
_TRIES = 3
"""Attempts at a motion: Ruckig, which franky uses, may find no trajectory until the arm stands still."""


class FrankaArm(Arm):
    """Arm moved by a driver in a separate process; nothing recovers automatically.

    Args:
        config: Driver, robot, speeds and forces.
        limits: Limits of every command.
    """

    links = PANDA_LINKS

    def __init__(self, config: FrankyArmConfig | PandaPyArmConfig, limits: ArmLimits):
        super().__init__(limits)
        self._config = config
        self._link: DriverLink | None = None
        self._was_idle = False

    # ------------------------------------------------------------------ connection

    def connect(self) -> None:
        """Connect robot and gripper; nothing moves.

        Raises:
            DriverMissing: The extra [franka] is not installed.
            IncompatibleDriver: The robot speaks another version than the installed wheel.
            NotConnected: No robot or hand there, another program holds it, its end effector is another, or
                with franky it is not idle, as in a reflex.
        """
        if self._link is None:
            self._link = self._new_link()
            self._load = None
            self._was_idle = False
            # The fingers may have been moved since this object was closed.
            self._held, self._moved_fingers = None, False

    def _new_link(self) -> DriverLink:
        config = self._config
        torque = isinstance(config, PandaPyArmConfig)
        settings = DriverSettings(
            host=config.host,
            realtime=config.realtime,
            contact_torque=[config.contact_torque] * 7,
            contact_force=config.contact_force,
            stiffness=list(config.stiffness) if torque else [],
            damping=list(config.damping) if torque else [],
            settle_s=config.settle_s,
        )
        link = DriverLink(config.driver, settings, config.connect_timeout_s)
        try:
            check_end_effector(self._state_of(link).f_t_ee)
        except BaseException:
            link.close()
            raise
        return link

    def close(self) -> None:
        """Stop the arm and close its link; safe to call twice."""
        if self._link is not None:
            link, self._link = self._link, None
            link.close()

    def _connected(self) -> bool:
        return self._link is not None

    def _connected_link(self) -> DriverLink:
        link = self._link
        if link is None:
            raise CommunicationLost("the arm was closed during the command; open the cell again")
        return link

    def _ask(self, op: str, *, timeout_s: float, **values: Any) -> Any:
        return self._connected_link().ask(op, timeout_s=timeout_s, **values)

    def _measure(self) -> DriverState:
        return self._state_of(self._connected_link())

    def _state_of(self, link: DriverLink) -> DriverState:
        return DriverState(**link.ask("state", timeout_s=self._config.patience_s))

    def _state(self) -> ArmState:
        state = self._measure()
        return ArmState(
            joints=np.array(state.joints),
            T_base_tcp=pose_from_columns(state.o_t_ee),
            gripper_width=state.width,
            timestamp_s=state.seconds,
            grasped=state.grasped,
            max_width=state.max_width if state.max_width > 0 else MAX_OPENING,
        )

    # ------------------------------------------------------------------ motions

    def _forward(self, joints: np.ndarray) -> Pose:
        return forward_pose(joints)

    def _forward_all(self, joints: np.ndarray) -> Pose:
        return forward_pose(joints)

    def _reachable(self, T_base_tcp: Pose) -> bool:
        return reachable(T_base_tcp, self.limits.joint_lower, self.limits.joint_upper)

    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        config = self._config
        self._travel(
            lambda here: joint_path(
                here,
                joints,
                speed=min(speed, self.pace * config.max_joint_speed) * JOINT_SPEED,
                acceleration=np.full(7, config.joint_acceleration),
            )
        )

    def _legs(self, T_base_tcp: Pose) -> list[Pose]:
        """With franky a line aslant to the axis of its turn is two motions: turned in place, then shifted.

        It gives the turn along the line and across it profiles of their own, and with both the joints
        accelerate by more than twice what is planned.
        """
        here = self._state().T_base_tcp
        shift = T_base_tcp.position - here.position
        turn = Rotation.from_quat(
            quat_multiply(T_base_tcp.quat_wxyz, quat_conjugate(here.quat_wxyz)), scalar_first=True
        ).as_rotvec()
        way, angle = np.linalg.norm(shift), np.linalg.norm(turn)
        if not isinstance(self._config, FrankyArmConfig) or way < _NO_SHIFT or angle < _NO_TURN:
            return [T_base_tcp]
        along = abs(float(shift @ turn)) / (way * angle)
        if along < _ALIGNED or along > 1 - _ALIGNED:
            return [T_base_tcp]
        return [Pose(position=here.position, quat_wxyz=T_base_tcp.quat_wxyz), T_base_tcp]

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        self._travel_straight(T_base_tcp, speed)

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        reflex = self._config.contact_force
        if force >= reflex:
            raise OutOfWorkspace(
                f"contact force {force:g} N is not under arm.contact_force {reflex:g} N, at which the robot "
                "stops by its own reflex: use less"
            )
        met = self._travel_straight(T_base_tcp, speed, force)
        if met is None:
            return None
        self._refuse_unless_idle(self._stand_still())
        return pose_from_columns(met)

    def _travel_straight(
        self, T_base_tcp: Pose, speed: float, until_force: float | None = None
    ) -> list[float] | None:
        config = self._config
        return self._travel(
            lambda here: straight_path(
                here,
                T_base_tcp,
                speed=min(speed, self.pace * config.max_speed),
                turn_speed=self.pace * TURN_SPEED,
                acceleration=config.acceleration,
                turn_acceleration=config.joint_acceleration,
                joint_speed=self.pace * config.max_joint_speed * JOINT_SPEED,
                lower=self.limits.joint_lower,
                upper=self.limits.joint_upper,
            ),
            T_base_tcp,
            until_force,
        )

    def _travel(
        self,
        path_from: Callable[[np.ndarray], JointPath],
        T_base_tcp: Pose | None = None,
        until_force: float | None = None,
    ) -> list[float] | None:
        """Follow a path from the current joints (7,), straight to a pose where one is given.

        It is planned again if the driver finds no trajectory.

        Returns:
            (16,) the TCP's pose at a contact over ``until_force``, N, as the driver gives it; None without.
        """
        for left in reversed(range(_TRIES)):
            path = path_from(np.array(self._ready().joints))
            try:
                return self._follow(path, T_base_tcp, until_force)
            except NoTrajectory:
                if not left or not _is_idle(self._stand_still()):
                    raise

    def _stand_still(self) -> DriverState:
        """Wait until the arm is at rest or the time is over; return the last state."""
        state, deadline = self._measure(), time.monotonic() + self._config.settle_s
        while time.monotonic() < deadline:
            time.sleep(_STANDING_S)
            before, state = state, self._measure()
            if np.abs(np.subtract(state.joints, before.joints)).max() < _STILL_JOINT:
                break
        return state

    def _follow(
        self, path: JointPath, T_base_tcp: Pose | None, until_force: float | None
    ) -> list[float] | None:
        # A driver that takes several times the duration of a motion hangs.
        timeout_s = 4 * path.duration_s + self._config.settle_s + self._config.patience_s
        values = {name: array.tolist() for name, array in asdict(path).items()}
        if T_base_tcp is not None:
            values |= {"T_base_tcp": T_base_tcp.as_matrix().tolist(), "until_force": until_force}
        op = "move_joints" if T_base_tcp is None else "move_straight"
        try:
            met = self._ask(op, timeout_s=timeout_s, **values)
        except MotionAborted as error:
            self._raise_aborted(error)
        if met is not None:
            return met
        deadline = time.monotonic() + self._config.settle_s
        # Closer than the base class requires, so that its check has a margin; an arm that approaches no
        # further is as close as it gets.
        nearest, since = math.inf, time.monotonic()
        while (error := self._error(path.joints[-1], T_base_tcp)) > 1 / 4:
            now = time.monotonic()
            if error < nearest - _STILL_ERROR:
                nearest, since = error, now
            if now > deadline or now - since > _STANDING_S or self._stop.is_set():
                break
            time.sleep(_POLL_S)
        return None

    def _error(self, joints: np.ndarray, T_base_tcp: Pose | None) -> float:
        """Distance to the goal as a fraction of what the base class tolerates."""
        state = self._measure()
        if T_base_tcp is None:
            return float(np.abs(np.array(state.joints) - joints).max()) / JOINT_TOLERANCE
        distance, angle = pose_distance(pose_from_columns(state.o_t_ee), T_base_tcp)
        return max(distance / POSITION_TOLERANCE, angle / ROTATION_TOLERANCE)

    def _wait(self, seconds: float) -> None:
        self._stop.wait(seconds)
        if not self._stop.is_set():
            self._ready()

    def _halt(self) -> None:
        # The motion in progress reports its own outcome; a lost link has stopped the robot.
        with contextlib.suppress(HalError):
            self._ask("stop", timeout_s=self._config.patience_s)

    def _recover(self) -> None:
        # Does not wait for the release: it must not start a motion of a program that is recovering.
        state = self._measure()
        if state.mode == "user_stopped":
            self._refuse(state)
        if not self._ask("recover", timeout_s=_GRIPPER_S + self._config.patience_s):
            self.close()
            self._link = self._new_link()
        deadline = time.monotonic() + _RECOVERY_S
        while not _is_idle(state := self._measure()) and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        self._refuse_unless_idle(state)
        if self._load is not None and state.load_mass == 0:
            self._set_load(self._load)

    def _ready(self) -> DriverState:
        """Current state, refused unless the robot is idle: the drivers themselves would recover silently."""
        state = self._measure()
        if self._was_idle and state.mode == "reflex":
            # Between two motions: what it met is a result of theirs, not an error of an earlier program.
            raise MotionAborted("the robot stopped by its reflex: free the arm, then call recover()")
        self._refuse_unless_idle(state)
        self._was_idle = True
        return state

    def _refuse_unless_idle(self, state: DriverState) -> None:
        if not _is_idle(state):
            self._refuse(state)

    def _refuse(self, state: DriverState) -> NoReturn:
        remedies = {
            "user_stopped": "release the user stop (external activation device)",
            "guiding": "let go of the guiding button",
            "reflex": "free the arm and check it",
            "other": "unlock the joints in Desk",
        }
        errors = f" with {state.errors}" if state.errors not in ("", "[]") else ""
        remedy = remedies.get(state.mode, "see Desk")
        start = "press and release the user stop and start" if state.mode == "reflex" else "start"
        raise NeedsRecovery(
            f"the robot is in mode {state.mode}{errors}, not idle: {remedy}, then call recover(), "
            f"or {start} again"
        )

    def _raise_aborted(self, error: MotionAborted) -> NoReturn:
        if self._stop.is_set():
            raise Stopped(STOPPED) from error
        raise error

    # ------------------------------------------------------------------ gripper

    def _gripper_timeout_s(self) -> float:
        return _GRIPPER_S + MAX_OPENING / self._config.gripper_speed + self._config.patience_s

    def _homed(self) -> DriverState:
        """Before homing the hand does not know its width and refuses to grasp."""
        state = self._ready()
        if state.load_mass > 0 and self._load is None:
            self._set_load(None)  # of an earlier program, whose part this one knows nothing about
        if state.max_width <= 0:
            self._home()
            state = self._measure()
        return state

    def _known_width(self) -> float:
        # Homing finds a greatest width some tenths of a millimetre off the datasheet's 80 mm; the hand
        # refuses anything wider.
        return self._homed().max_width

    def _home(self) -> None:
        self._ready()
        try:
            homed = self._ask("home_gripper", timeout_s=self._gripper_timeout_s())
        except MotionAborted as error:
            self._raise_aborted(error)
        if not homed:
            raise MotionAborted("the gripper could not be homed; free the fingers, then call recover()")

    def _move_gripper(self, width: float) -> None:
        try:
            self._ask(
                "move_gripper",
                timeout_s=self._gripper_timeout_s(),
                width=width,
                speed=self._config.gripper_speed,
            )
        except MotionAborted as error:
            self._raise_aborted(error)
        self._still_width()

    def _grasp(self, force: float) -> GraspOutcome:
        self._homed()
        # The answer does not count: some firmware reports an empty grasp by "Command failed!" or "Command
        # aborted!", and a second grasp of a held part by False. What holds is what the hand then measures.
        with contextlib.suppress(MotionAborted):
            self._ask(
                "grasp",
                timeout_s=self._gripper_timeout_s(),
                speed=self._config.gripper_speed,
                force=force,
            )
        self._still_width()
        state = self._state()
        return GraspOutcome(width=state.gripper_width, holding=self.holds(state))

    def _set_load(self, load: Load | None) -> None:
        mass = 0.0 if load is None else float(load.mass)
        centre, inertia = ([0.0] * 3, [0.0] * 9) if load is None else load_in_flange(load)
        self._ask("set_load", timeout_s=self._config.patience_s, mass=mass, centre=centre, inertia=inertia)

    def _hand(self) -> ConfiguredHand:
        state = self._measure()
        return ConfiguredHand(
            mass=state.ee_mass, centre_flange=np.array(state.ee_centre), load_mass=state.load_mass
        )

    def _still_width(self) -> float:
        """Width once the fingers are at rest; the hand reports success slightly earlier."""
        deadline = time.monotonic() + self._config.settle_s
        width, quiet = self._measure().width, 0
        while quiet < 2 and time.monotonic() < deadline and not self._stop.is_set():
            time.sleep(2 * _POLL_S)
            last, width = width, self._measure().width
            quiet = quiet + 1 if abs(width - last) < _STILL_WIDTH else 0
        return width


def _is_idle(state: DriverState) -> bool:
    return state.mode in ("idle", "move")
