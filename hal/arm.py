"""What an arm with a parallel gripper is, whatever stands behind it."""

from __future__ import annotations

import threading
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from hal.device import Device
from hal.errors import MotionAborted, NeedsRecovery, NotConnected, OutOfWorkspace
from mskgrasp.geometry import Pose, quat_conjugate, quat_multiply
from mskgrasp.grasp import MAX_OPENING, PAD_REACH, TABLE_CLEARANCE, lowest_grasp_z

JOINT_TOLERANCE = 5e-3
"""A joint motion has arrived within this, radians."""
POSITION_TOLERANCE = 2e-3
"""A straight motion has arrived within this, metres."""
ROTATION_TOLERANCE = 1e-2
"""A straight motion has arrived within this, radians."""


_PATH_CHECKS = 16
# Corners of the pads and of the palm in the tcp frame, metres (collision boxes of the Panda's hand).
_HAND_CORNERS = np.array(
    [
        [x * half_x, y * half_y, z]
        for half_x, half_y, z in ((0.011, 0.056, PAD_REACH), (0.032, 0.102, -0.0375))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
)


def lowest_point(T_base_tcp: Pose) -> float:
    """Height of the lowest corner of the open hand, base frame, metres."""
    return float(T_base_tcp.apply(_HAND_CORNERS)[:, 2].min())


@dataclass(frozen=True, kw_only=True)
class ArmState:
    """Where the arm is.

    Attributes:
        joints: (7,) radians.
        T_base_tcp: Measured pose of the TCP in the base.
        gripper_width: Distance between the pads, metres.
        timestamp_s: When it was measured, seconds on the monotonic clock of this machine.
    """

    joints: np.ndarray
    T_base_tcp: Pose
    gripper_width: float
    timestamp_s: float


@dataclass(frozen=True, kw_only=True)
class GraspOutcome:
    """What the fingers met.

    Attributes:
        width: Distance between the pads, metres.
        holding: Whether something is between them.
    """

    width: float
    holding: bool


@dataclass(frozen=True, kw_only=True)
class ArmLimits:
    """What every command is checked against before anything moves.

    Attributes:
        joint_lower: (7,) radians.
        joint_upper: (7,) radians.
        box_lower: (3,) the TCP stays inside this box, base frame, metres.
        box_upper: (3,) the other corner.
        table_z: Height of the table, base frame, metres; the pads stay clear of it.
        max_force: Greatest gripper force, N.
    """

    joint_lower: np.ndarray
    joint_upper: np.ndarray
    box_lower: np.ndarray
    box_upper: np.ndarray
    table_z: float
    max_force: float


class Arm(Device):
    """A seven-axis arm with a parallel gripper; SI units, poses in the base frame.

    Commands block until the motion is over. The base class checks limits before a motion and arrival
    after it; a backend only moves. A command that is refused (`OutOfWorkspace`) changes nothing. After
    any other error nothing moves until `recover` is called. Construction neither connects nor moves.
    """

    def __init__(self, limits: ArmLimits):
        self.limits = limits
        self._fault: str | None = None
        self._stop = threading.Event()

    # ------------------------------------------------------------------ commands

    def state(self) -> ArmState:
        """Measures where the arm is.

        Raises:
            NotConnected, CommunicationLost: There is no arm to ask.
        """
        self._require_connection()
        return self._state()

    def move_to_joints(self, joints: np.ndarray, *, speed: float = 0.3) -> None:
        """Moves all joints to (7,) radians at a fraction ``speed`` of their greatest speeds.

        Raises:
            OutOfWorkspace: A joint limit would be passed; nothing moved.
            MotionAborted: Stopped, in contact, or not arrived.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        target = np.asarray(joints, dtype=np.float64)
        lower, upper = self.limits.joint_lower, self.limits.joint_upper
        if target.shape != (7,) or not np.isfinite(target).all():
            raise OutOfWorkspace(f"joints must be 7 finite numbers, got {joints!r}")
        outside = np.flatnonzero((target < lower) | (target > upper))
        if len(outside):
            i = outside[0]
            raise OutOfWorkspace(
                f"joint {i + 1} to {target[i]:.3f} rad is outside {lower[i]:.3f} .. {upper[i]:.3f} rad"
            )
        if not 0 < speed <= 1:
            raise OutOfWorkspace(f"speed {speed:g} is outside 0 .. 1 (a fraction of the greatest)")
        self._require_connection()
        self._check_joint_path(self._state().joints, target)
        with self._motion():
            self._move_to_joints(target, speed)
            error = np.abs(self._state().joints - target).max()
            if error > JOINT_TOLERANCE:
                raise MotionAborted(f"the arm stopped {error:.4f} rad short of its joint target")

    def move_to_pose(self, T_base_tcp: Pose, *, speed: float = 0.1) -> None:
        """Moves the TCP along a straight line to a pose, ``speed`` m/s at most.

        Raises:
            OutOfWorkspace: The pose is outside the box, too near the table, or out of reach; nothing moved.
            MotionAborted: Stopped, in contact, or not arrived.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        self.check_pose(T_base_tcp)
        if not 0 < speed <= 1:
            raise OutOfWorkspace(f"speed {speed:g} m/s is outside 0 .. 1 m/s")
        with self._motion():
            self._move_to_pose(T_base_tcp, speed)
            reached = self._state().T_base_tcp
            distance = float(np.linalg.norm(reached.position - T_base_tcp.position))
            turn = quat_multiply(quat_conjugate(reached.quat_wxyz), T_base_tcp.quat_wxyz)
            angle = 2 * float(np.arctan2(np.linalg.norm(turn[1:]), abs(turn[0])))
            if distance > POSITION_TOLERANCE or angle > ROTATION_TOLERANCE:
                raise MotionAborted(
                    f"the arm stopped {distance * 1e3:.1f} mm and {angle:.3f} rad short of its pose"
                )

    def move_gripper(self, width: float) -> None:
        """Moves the pads to a distance in metres; for holding something use `grasp`.

        Raises:
            OutOfWorkspace: The width is outside 0 .. 0.08 m; nothing moved.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        if not 0 <= width <= MAX_OPENING:
            raise OutOfWorkspace(f"gripper width {width:g} m is outside 0 .. {MAX_OPENING} m")
        with self._motion():
            self._move_gripper(width)

    def grasp(self, force: float) -> GraspOutcome:
        """Closes the fingers until they hold something with ``force`` newtons, or meet.

        A grasp that finds nothing is an outcome, not an error.

        Raises:
            OutOfWorkspace: The force is outside the gripper's range; nothing moved.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        if not 0 < force <= self.limits.max_force:
            raise OutOfWorkspace(f"grasp force {force:g} N is outside 0 .. {self.limits.max_force:g} N")
        with self._motion():
            return self._grasp(force)

    def wait(self, seconds: float) -> None:
        """Holds still for a time, seconds of the cell's own clock.

        Raises:
            MotionAborted: Stopped.
            NeedsRecovery: An earlier error was not acknowledged.
        """
        with self._motion():
            self._wait(seconds)

    def stop(self) -> None:
        """Stops the motion in progress, from any thread; it ends with `MotionAborted`."""
        self._stop.set()
        if self._connected():
            self._halt()

    def recover(self) -> None:
        """Acknowledges an error so that the arm may move again.

        Raises:
            NotConnected, CommunicationLost: There is no arm to recover.
        """
        self._require_connection()
        self._recover()
        self._stop.clear()
        self._fault = None

    # ------------------------------------------------------------------ checks

    def check_pose(self, T_base_tcp: Pose) -> None:
        """Refuses a target outside the workspace, out of reach or too near the table; moves nothing.

        Raises:
            OutOfWorkspace: Says what is wrong with it.
        """
        position = np.asarray(T_base_tcp.position)
        lower, upper = self.limits.box_lower, self.limits.box_upper
        shown = ", ".join(f"{value:.3f}" for value in position)
        if position.shape != (3,) or not np.isfinite(position).all():
            raise OutOfWorkspace(f"a target pose must be one pose of finite numbers, got ({shown})")
        if (position < lower).any() or (position > upper).any():
            raise OutOfWorkspace(
                f"TCP target ({shown}) m is outside the workspace {np.round(lower, 3).tolist()} .. "
                f"{np.round(upper, 3).tolist()} m"
            )
        clearance = lowest_point(T_base_tcp) - self.limits.table_z
        if clearance < TABLE_CLEARANCE - 1e-6:
            raise OutOfWorkspace(
                f"TCP target z {position[2]:.4f} m would bring the hand {clearance * 1e3:.1f} mm over the "
                f"table; it must stay {TABLE_CLEARANCE * 1e3:g} mm above (pointing down: z >= "
                f"{lowest_grasp_z(self.limits.table_z):.4f} m)"
            )
        if not self._reachable(T_base_tcp):
            raise OutOfWorkspace(f"TCP target ({shown}) m is out of the arm's reach")

    def _check_joint_path(self, start: np.ndarray, target: np.ndarray) -> None:
        """Refuses a joint motion whose end, or way, brings the hand to the table or out of the box."""
        begin = lowest_point(self._forward(start))
        lowest = min(begin, self.limits.table_z + TABLE_CLEARANCE) - 1e-3
        for share in np.linspace(0, 1, _PATH_CHECKS)[1:]:
            height = lowest_point(self._forward(start + share * (target - start)))
            if height < lowest:
                raise OutOfWorkspace(
                    f"the way to these joints brings the hand to {height:.3f} m; the table is at "
                    f"{self.limits.table_z:g} m"
                )
        end = self._forward(target).position
        if (end < self.limits.box_lower).any() or (end > self.limits.box_upper).any():
            raise OutOfWorkspace(
                f"these joints put the TCP at {np.round(end, 3).tolist()} m, outside the workspace"
            )

    def _require_connection(self) -> None:
        if not self._connected():
            raise NotConnected(
                f"{type(self).__name__} is not connected; use it inside its context (with ...)"
            )

    @contextmanager
    def _motion(self) -> Iterator[None]:
        self._require_connection()
        if self._fault is not None:
            raise NeedsRecovery(f"the arm stopped before ({self._fault}); look at it, then call recover()")
        if self._stop.is_set():
            raise NeedsRecovery("stop() was called; call recover() before the next motion")
        try:
            yield
            if self._stop.is_set():
                raise MotionAborted("stop() was called; call recover() when it is safe")
        except OutOfWorkspace:
            raise  # found out before anything moved
        except BaseException as error:
            self._fault = str(error) or type(error).__name__
            self._halt()
            raise

    # ------------------------------------------------------------------ what a backend does

    @abstractmethod
    def _connected(self) -> bool: ...

    @abstractmethod
    def _state(self) -> ArmState: ...

    @abstractmethod
    def _forward(self, joints: np.ndarray) -> Pose:
        """``T_base_tcp`` at joints (7,)."""

    @abstractmethod
    def _reachable(self, T_base_tcp: Pose) -> bool:
        """Whether some joints within their limits put the TCP there."""

    @abstractmethod
    def _move_to_joints(self, joints: np.ndarray, speed: float) -> None: ...

    @abstractmethod
    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None: ...

    @abstractmethod
    def _move_gripper(self, width: float) -> None: ...

    @abstractmethod
    def _grasp(self, force: float) -> GraspOutcome: ...

    @abstractmethod
    def _wait(self, seconds: float) -> None: ...

    @abstractmethod
    def _halt(self) -> None: ...

    @abstractmethod
    def _recover(self) -> None: ...
