"""Abstract arm with a parallel gripper."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from hal.arm_state import ArmState, GraspOutcome, Held
from hal.collisions import check_joints, check_path, line_joints
from hal.device import Device
from hal.errors import LoadTooHeavy, MotionAborted, NotConnected, OutOfWorkspace
from hal.hand import ConfiguredHand, Load, holds
from hal.limits import (
    ArmLimits,
    check_joint_path,
    check_line,
    check_target_joints,
    check_target_pose,
    shown,
    touching,
)
from hal.motion_gate import MotionGate
from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.panda_body import HAND_MASS, PAYLOAD, Links

JOINT_TOLERANCE = 5e-3
"""Greatest error of each joint at the end of a joint motion, radians."""
POSITION_TOLERANCE = 2e-3
"""Greatest position error of the TCP at the end of a straight motion, metres."""
ROTATION_TOLERANCE = 1e-2
"""Greatest rotation error of the TCP at the end of a straight motion, radians."""
WIDTH_TOLERANCE = 2e-3
"""Greatest error of the pads' distance at the end of a motion, metres."""
MAX_TOUCH_FORCE = 15.0
"""Greatest force at which `Arm.move_until_contact` ends, N."""
MAX_TOUCH_SPEED = 0.05
"""Greatest speed of that motion, m/s: the arm still moves while the contact is detected."""


class Arm(Device):
    """An arm of any number of joints with a parallel gripper; SI units, poses in the base frame.

    Commands block until the motion is over; a command of another thread waits for that, too. The
    base class checks limits before a motion and arrival after it; a backend only moves. A command that is
    refused (`OutOfWorkspace`) changes nothing. After any other error nothing moves until `recover` is
    called. Construction neither connects nor moves.

    Attributes:
        simulated: Nothing moves in the real world, so no operator needs to confirm.
        links: Outline of the arm, which keeps off table and keep-outs; None: the hand alone is checked.
        pace: Share of the speeds at which it would move otherwise: `slow_down`.
    """

    simulated: bool = False
    links: Links | None = None

    def __init__(self, limits: ArmLimits):
        self.limits = limits
        self._gate = MotionGate()
        self._stop = self._gate.stop
        self._held: Held | None = None
        self._moved_fingers = False
        self._load: Load | None = None
        self.pace = 1.0

    # ------------------------------------------------------------------ commands

    def state(self) -> ArmState:
        """Measure joints, TCP and gripper width.

        Raises:
            NotConnected, CommunicationLost: The arm is not connected or does not answer.
        """
        self._require_connection()
        return self._state()

    def slow_down(self, pace: float) -> None:
        """Move the arm from now on at a share of the speeds at which it would move otherwise; 1 ends that.

        The fingers are as fast as ever.
        """
        if not 0 < pace <= 1:
            raise ValueError(f"pace {pace:g} is outside 0 .. 1")
        self.pace = pace

    def move_to_joints(self, joints: np.ndarray, *, speed: float = 0.3) -> None:
        """Move all joints to (n,) radians at a fraction ``speed`` of their greatest speeds.

        Raises:
            OutOfWorkspace: A joint limit would be passed, or a link would come too near to the table or a
                keep-out; nothing moved.
            MotionAborted: Stopped, in contact, or not arrived.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        target = np.asarray(joints, dtype=np.float64)
        check_target_joints(self.limits, target)
        if not 0 < speed <= 1:
            raise OutOfWorkspace(f"speed {speed:g} is outside 0 .. 1 (a fraction of the greatest)")
        with self._motion():
            here = self._state().joints
            check_joint_path(self.limits, self._forward_all, here, target)
            if self.links is not None:
                check_path(self.links, self.limits, np.stack([here, target]), "the way to these joints")
            self._move_to_joints(target, self.pace * speed)
            error = np.abs(self._state().joints - target).max()
            if error > JOINT_TOLERANCE:
                raise MotionAborted(f"the arm stopped {error:.4f} rad short of its joint target")

    def move_to_pose(self, T_base_tcp: Pose, *, speed: float = 0.1) -> None:
        """Move the TCP along a straight line to a pose, ``speed`` m/s at most.

        Raises:
            OutOfWorkspace: The pose is outside the box, too near the table, or out of reach, or a link would
                come too near to the table or a keep-out; nothing moved.
            MotionAborted: Stopped, in contact, or not arrived.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        self.check_pose(T_base_tcp)
        if not 0 < speed <= 1:
            raise OutOfWorkspace(f"speed {speed:g} m/s is outside 0 .. 1 m/s")
        with self._motion():
            legs = self._legs(T_base_tcp)
            self._check_line(self.limits, *legs)
            for number, leg in enumerate(legs):
                try:
                    self._move_to_pose(leg, self.pace * speed)
                except OutOfWorkspace as error:
                    if number == 0:
                        raise
                    raise MotionAborted(f"the arm stopped part of the way: {error}") from error
            self._check_arrival(T_base_tcp)

    def move_until_contact(self, T_base_tcp: Pose, *, force: float = 5.0, speed: float = 0.01) -> Pose | None:
        """Move the TCP along a straight line towards a pose until the hand meets something.

        The only motion that may bring the hand to the table, and `hal.limits.TOUCH_DEPTH` below its stated
        height. After a contact, which is no error, the arm stands still there; move away from it next.

        Args:
            T_base_tcp: Where the motion ends at the latest.
            force: External force on the hand, more than at the start, that is a contact, N.
            speed: Greatest speed, m/s.

        Returns:
            ``T_base_tcp`` measured at the contact; None if the pose was reached without one.

        Raises:
            OutOfWorkspace: The pose, force or speed is outside its limits, or out of reach; nothing moved.
            MotionAborted: Stopped, or the robot's own reflex was quicker; use less speed or force.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        if not 0 < force <= MAX_TOUCH_FORCE:
            raise OutOfWorkspace(f"contact force {force:g} N is outside 0 .. {MAX_TOUCH_FORCE:g} N")
        if not 0 < speed <= MAX_TOUCH_SPEED:
            raise OutOfWorkspace(
                f"speed {speed:g} m/s is outside 0 .. {MAX_TOUCH_SPEED:g} m/s towards a contact"
            )
        limits = touching(self.limits)
        self._check_pose(limits, T_base_tcp)
        with self._motion():
            self._check_line(limits, T_base_tcp)
            contact = self._move_until_contact(T_base_tcp, force, self.pace * speed)
            if contact is None:
                self._check_arrival(T_base_tcp)
            return contact

    def move_gripper(self, width: float) -> None:
        """Move the pads to a distance in metres; to hold something use `grasp`.

        A load that was set is cleared: what the hand held, it has released.

        Raises:
            OutOfWorkspace: The width is outside the hand's stroke, or more than it opens; nothing moved.
            MotionAborted: Stopped, or an obstacle blocks the fingers.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        stroke = self.limits.gripper.stroke
        if not 0 <= width <= stroke:
            raise OutOfWorkspace(f"gripper width {width:g} m is outside 0 .. {stroke:g} m")
        with self._motion():
            most = self._known_width()
            if width > most + WIDTH_TOLERANCE:
                raise OutOfWorkspace(
                    f"gripper width {width:g} m is outside 0 .. {most:.4f} m, which homing found; open the "
                    "hand with open_gripper(), and home it after changing fingers (python -m hal.home)"
                )
            self._move_pads(min(width, most))

    def open_gripper(self) -> None:
        """Open the fingers as far as this hand does, `ArmState.max_width`; a load is cleared.

        Raises:
            MotionAborted: Stopped, or an obstacle blocks the fingers.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        with self._motion():
            self._move_pads(self._known_width())

    def home(self) -> None:
        """Home the gripper: the fingers close and open, so that the hand knows its greatest width again.

        Needed after the fingers were changed; what the hand holds falls, a load is cleared. The arm stands
        still. A hand that needs no homing opens.

        Raises:
            MotionAborted: Stopped, or an obstacle blocks the fingers.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        with self._motion():
            self._home()
            self._held = None
            self._moved_fingers = True
            self._clear_load()

    def _move_pads(self, width: float) -> None:
        self._move_gripper(width)
        self._held = None
        self._moved_fingers = True
        reached = self._state().gripper_width
        if self._stop.is_set():
            return
        if abs(reached - width) > WIDTH_TOLERANCE:
            raise MotionAborted(
                f"the pads stopped at {reached:.4f} m instead of {width:.4f} m; remove "
                "the obstacle, then call recover()"
            )
        self._clear_load()

    def _clear_load(self) -> None:
        if self._load is not None:
            self._set_load(None)
            self._load = None

    def grasp(self, force: float) -> GraspOutcome:
        """Close the fingers until they hold something with ``force`` newtons, or meet.

        A grasp that finds nothing is an outcome, not an error.

        Raises:
            OutOfWorkspace: The force is outside the gripper's range; nothing moved.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        least, most = self.limits.gripper.force[0], self.limits.max_force
        if not (0 < force and least <= force <= most):
            raise OutOfWorkspace(f"grasp force {force:g} N is outside {least:g} .. {most:g} N")
        with self._motion():
            outcome = self._grasp(force)
            at = self._state().T_base_tcp
            self._held = Held(T_base_tcp=at, width=outcome.width) if outcome.holding else None
            self._moved_fingers = True
            return outcome

    def in_hand(self) -> Held | None:
        """What `grasp` closed on, if the fingers still hold it by `holds` where they closed; None if not.

        Until this program moves the fingers, what the hand itself reports: an earlier one may have been ended
        with a part in the hand.

        Raises:
            NotConnected, CommunicationLost: The arm is not connected or does not answer.
        """
        self._require_connection()
        if self._moved_fingers and self._held is None:
            return None
        state = self._state()
        if not self.holds(state):
            return None
        if self._held is not None:
            return None if self._held.lost(state.gripper_width) else self._held
        open_ = state.gripper_width > state.max_width - WIDTH_TOLERANCE
        return None if open_ or not state.grasped else Held(T_base_tcp=None, width=state.gripper_width)

    @property
    def may_drop(self) -> bool:
        """Whether what the hand holds may fall without harm: a simulated part, or a replay of one."""
        return self.simulated

    def holds(self, state: ArmState) -> bool:
        """Whether the fingers hold something in a state, by the rule `hal.hand.holds`."""
        return holds(state.gripper_width, state.grasped, self.limits.closed_width)

    def set_load(self, load: Load | None) -> None:
        """Tell the arm which part its fingers hold, so that it compensates the weight; None for none.

        Call it between grasp and lift; moving the fingers (`move_gripper`, `open_gripper`, `home`) clears it.

        Raises:
            LoadTooHeavy: The part weighs more than the arm carries; the load is as before.
            MotionAborted: The robot refused it.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        if load is not None:
            self.check_load(load.mass)
        with self._motion():
            self._set_load(load)
            self._load = load

    def hand(self) -> ConfiguredHand | None:
        """The end effector that the robot is configured for; None where the arm does not report it.

        Raises:
            NotConnected, CommunicationLost: The arm is not connected or does not answer.
        """
        self._require_connection()
        return self._hand()

    def wait(self, seconds: float) -> None:
        """Hold still for a time, seconds of the cell's own clock.

        Raises:
            OutOfWorkspace: The time is outside 0 .. 3600 s.
            MotionAborted: Stopped.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        if not 0 <= seconds <= 3600:
            raise OutOfWorkspace(f"waiting time {seconds:g} s is outside 0 .. 3600 s")
        with self._motion():
            self._wait(seconds)

    def stop(self) -> None:
        """Stop the motion in progress, which ends with `Stopped`; safe from any thread."""
        self._stop.set()
        if self._connected():
            self._halt()

    def recover(self) -> None:
        """Acknowledge an error so that the arm may move again; wait for a motion in progress.

        Raises:
            NeedsRecovery: The cause is still present, such as a pressed user stop.
            NotConnected, CommunicationLost: The arm is not connected or does not answer.
        """
        self._require_connection()
        self._gate.recover(self._recover)

    # ------------------------------------------------------------------ checks

    def check_pose(self, T_base_tcp: Pose) -> None:
        """Refuse a target outside the workspace, out of reach or too near the table; move nothing.

        Raises:
            OutOfWorkspace: Names the limit that the target violates.
        """
        self._check_pose(self.limits, T_base_tcp)

    def legs(self, T_base_tcp: Pose) -> list[Pose]:
        """Ends of the straight motions by which `move_to_pose` would go to a pose from here, the pose last.

        Most arms go there by one. Nothing moves.

        Raises:
            NotConnected, CommunicationLost: The arm is not connected or does not answer.
        """
        self._require_connection()
        return self._legs(T_base_tcp)

    def check_joints(self, joints: np.ndarray) -> None:
        """Refuse a target of (n,) radians outside its limits or the workspace, or too near to something.

        Nothing moves, and the arm need not be connected.

        Raises:
            OutOfWorkspace: Names the limit that the target violates.
        """
        target = np.asarray(joints, dtype=np.float64)
        check_target_joints(self.limits, target)
        check_target_pose(self.limits, self._forward(target))
        if self.links is not None:
            check_joints(self.links, self.limits, target)

    def check_load(self, mass: float) -> None:
        """Refuse a part that the arm cannot carry, by its mass in kg; move nothing.

        Raises:
            LoadTooHeavy: Names both masses and the remedy.
        """
        if not mass <= self.limits.max_load:
            remedy = (
                "or on a real cell raise arm.contact_force and arm.contact_torque (docs/real_cell.md)"
                if mass <= PAYLOAD - HAND_MASS
                else "or check its density"  # no threshold lets the robot carry it
            )
            raise LoadTooHeavy(
                f"the part weighs {mass:.3f} kg, this arm carries {self.limits.max_load:.3f} kg: leave it "
                f"out, {remedy}"
            )

    def _check_pose(self, limits: ArmLimits, T_base_tcp: Pose) -> None:
        check_target_pose(limits, T_base_tcp)
        if not self._reachable(T_base_tcp):
            raise OutOfWorkspace(f"TCP target {shown(T_base_tcp.position)} m is out of the arm's reach")
        if self.links is not None:
            # Where it is exactly depends on the way there: what touches nowhere is left to the motion.
            check_joints(self.links, limits, self.links.joints_at(T_base_tcp), margin=0.0)

    def _check_line(self, limits: ArmLimits, *legs: Pose) -> None:
        state = self._state()
        here, joints = state.T_base_tcp, state.joints
        for leg in legs:
            check_line(limits, here, leg)
            if self.links is not None:
                path = line_joints(self.links, limits, joints, here, leg)
                check_path(self.links, limits, path, "the straight line to this pose")
                joints = path[-1]
            here = leg

    def _check_arrival(self, T_base_tcp: Pose) -> None:
        distance, angle = pose_distance(self._state().T_base_tcp, T_base_tcp)
        if distance > POSITION_TOLERANCE or angle > ROTATION_TOLERANCE:
            raise MotionAborted(
                f"the arm stopped {distance * 1e3:.1f} mm and {angle:.3f} rad short of its pose"
            )

    def _require_connection(self) -> None:
        if not self._connected():
            raise NotConnected(
                f"{type(self).__name__} is not connected; use it inside its context (with ...)"
            )

    @contextmanager
    def _motion(self) -> Iterator[None]:
        self._require_connection()
        with self._gate.motion(self._halt):
            yield

    # ------------------------------------------------------------------ interface of a backend

    @abstractmethod
    def _connected(self) -> bool: ...

    @abstractmethod
    def _state(self) -> ArmState: ...

    @abstractmethod
    def _forward(self, joints: np.ndarray) -> Pose:
        """``T_base_tcp`` at joints (n,)."""

    def _forward_all(self, joints: np.ndarray) -> Pose:
        """``T_base_tcp`` (k,) at joints (k, n); a backend may do it faster."""
        poses = [self._forward(one) for one in joints]
        return Pose(
            position=np.stack([pose.position for pose in poses]),
            quat_wxyz=np.stack([pose.quat_wxyz for pose in poses]),
        )

    @abstractmethod
    def _reachable(self, T_base_tcp: Pose) -> bool:
        """Whether joints within their limits reach the pose."""

    @abstractmethod
    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None:
        """Move; ``speed`` is slowed down already, a greatest speed of the backend's own is not: ``pace``."""

    def _legs(self, T_base_tcp: Pose) -> list[Pose]:
        """Ends of the straight motions that lead to a pose, which is the last of them."""
        return [T_base_tcp]

    @abstractmethod
    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None: ...

    @abstractmethod
    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        """``T_base_tcp`` measured at the contact, where the arm then stands; None without one."""

    @abstractmethod
    def _move_gripper(self, width: float) -> None: ...

    @abstractmethod
    def _grasp(self, force: float) -> GraspOutcome: ...

    def _known_width(self) -> float:
        """Greatest distance of the pads, metres; a hand that does not know it yet is homed first."""
        return self.limits.gripper.stroke

    def _home(self) -> None:
        """Home the fingers; a hand that needs no homing opens them."""
        self._move_gripper(self._known_width())

    def _set_load(self, load: Load | None) -> None:
        """Compensate the weight of a part from now on; an arm that holds its pose under any load need not."""

    def _hand(self) -> ConfiguredHand | None:
        return None

    @abstractmethod
    def _wait(self, seconds: float) -> None: ...

    @abstractmethod
    def _halt(self) -> None: ...

    @abstractmethod
    def _recover(self) -> None: ...
