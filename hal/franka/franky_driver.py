"""Driver on franky; runs in a driver's process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from hal.franka.driver import MODES, DriverSettings, DriverState, column_major
from hal.franka.path import JointPath

if TYPE_CHECKING:
    import franky

_POLL_S = 0.02
_OWED_S = 0.5


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
        self._gripper = franky.Gripper(settings.host)

    def state(self) -> DriverState:
        """Measure; may be called during a motion."""
        robot, gripper = self._robot.state, self._gripper.state
        if not self._robot.is_in_control:
            # The first of the waiting states is from before this call; the one after it is not.
            robot = self._robot.state
        return DriverState(
            joints=[float(value) for value in robot.q],
            o_t_ee=column_major(robot.O_T_EE.matrix),
            f_t_ee=column_major(robot.F_T_EE.matrix),
            width=gripper.width,
            max_width=gripper.max_width,
            mode=MODES[int(robot.robot_mode)],
            errors=str(robot.current_errors),
            seconds=time.monotonic(),
        )

    def move(self, path: JointPath) -> None:
        """Follow a path through its knots, with the knots' speeds; between them franky interpolates."""
        franky = self._franky
        path = path.without_creep()
        waypoints = [
            franky.JointWaypoint(
                franky.JointState(joints, speed),
                minimum_time=franky.Duration(round((after - before) * 1000)),
            )
            for joints, speed, before, after in zip(
                path.joints[1:], path.speeds[1:], path.seconds[:-1], path.seconds[1:], strict=True
            )
        ]
        if self._stopped.is_set():
            raise RuntimeError("Move command preempted!")
        self._robot.move(franky.JointWaypointMotion(waypoints), asynchronous=True)
        while not self._robot.join_motion(timeout=_POLL_S):
            if self._stopped.is_set():
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
