"""Interface of the vendors' drivers, and the messages between the processes.

A driver runs in a separate process (`hal.franka.worker`), because both packages hold Python's global
lock while they connect, and a robot that another program holds never answers: in the program's process that
would block everything, Ctrl-C included. A process can be killed; the robot stops when its link closes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from hal.franka.path import JointPath

DriverName = Literal["franky", "panda_py"]

Mode = Literal["other", "idle", "move", "guiding", "reflex", "user_stopped", "recovery"]
"""libfranka's robot modes."""

MODES: tuple[Mode, ...] = ("other", "idle", "move", "guiding", "reflex", "user_stopped", "recovery")


@dataclass(frozen=True, kw_only=True)
class DriverSettings:
    """Settings sent to a driver when it connects.

    Attributes:
        host: Name or address of the robot.
        realtime: Require real-time scheduling.
        contact_torque: (7,) N m over which a joint's reflex stops the arm.
        contact_force: N (and N m for turns) at the TCP over which the reflex stops the arm.
        stiffness: (7,) N m/rad, for drivers that control torques.
        damping: (7,) N m s/rad, for the same drivers.
        settle_s: Greatest time to come to rest at the goal of a motion, s.
    """

    host: str
    realtime: bool
    contact_torque: list[float]
    contact_force: float
    stiffness: list[float]
    damping: list[float]
    settle_s: float


@dataclass(frozen=True, kw_only=True)
class DriverState:
    """A fresh measurement, in libfranka's own terms.

    Attributes:
        joints: (7,) radians.
        o_t_ee: (16,) pose of the end effector in the base, column-major, metres.
        f_t_ee: (16,) pose of the end effector in the flange, column-major, metres.
        width: Distance of the pads, metres.
        max_width: Greatest width, found by homing, metres; 0 before homing.
        grasped: Whether the hand reports a grasp (``is_grasped``).
        ee_mass: Mass of the end effector that Desk states (``m_ee``), kg.
        ee_centre: (3,) its centre of mass in the flange (``F_x_Cee``), metres.
        load_mass: Mass of the load last set (``m_load``), kg; 0 for none.
        mode: Mode of the robot.
        errors: Names of libfranka's errors in force, empty where there are none.
        seconds: Time of the measurement on the monotonic clock, s.
    """

    joints: list[float]
    o_t_ee: list[float]
    f_t_ee: list[float]
    width: float
    max_width: float
    grasped: bool
    ee_mass: float
    ee_centre: list[float]
    load_mass: float
    mode: Mode
    errors: str
    seconds: float


class Driver(Protocol):
    """The vendor's package behind a few verbs; anything it raises is explained by `hal.franka.faults`."""

    def connect(self, settings: DriverSettings) -> None:
        """Open robot and gripper; nothing moves."""
        ...

    def state(self) -> DriverState:
        """Measure; may be called during a motion."""
        ...

    def move_joints(self, path: JointPath) -> None:
        """Move to the end of a path of `joint_path` in its time; return when the arm is there, or raise."""
        ...

    def move_straight(
        self, path: JointPath, T_base_tcp: np.ndarray, until_force: float | None = None
    ) -> list[float] | None:
        """Move the TCP straight to a pose (4, 4) in its path's time; return when it is there, or raise.

        An external force on the hand of ``until_force``, N, more than at the start, ends the motion.

        Returns:
            (16,) ``o_t_ee`` measured at that force, with the arm at rest; None at the pose.
        """
        ...

    def home_gripper(self) -> bool:
        """Open and close the fingers to find their greatest width."""
        ...

    def move_gripper(self, width: float, speed: float) -> bool:
        """Move the pads to a width in metres, at a speed in m/s."""
        ...

    def grasp(self, speed: float, force: float) -> bool:
        """Close with a force in N until the pads hold something or meet."""
        ...

    def set_load(self, mass: float, centre: Sequence[float], inertia: Sequence[float]) -> None:
        """State the part in the hand to an arm at rest; mass 0 for none.

        Args:
            mass: kg.
            centre: (3,) centre of mass in the flange, metres.
            inertia: (9,) about the centre of mass, flange axes, column-major, kg m^2.
        """
        ...

    def stop(self) -> None:
        """End a motion of arm and fingers, and any to come before `recover`; from another thread."""
        ...

    def recover(self) -> bool:
        """Acknowledge the robot's errors, and a stop.

        Returns:
            False where a stopped gripper never answered: its link must be opened again.
        """
        ...


def felt_force(wrench: Sequence[float] | np.ndarray, at_start: Sequence[float] | np.ndarray) -> float:
    """Force, N, of an external wrench (6,) beyond that at the start of a motion, which is a model's error."""
    return float(np.linalg.norm(np.subtract(wrench, at_start)[:3]))


def column_major(matrix: np.ndarray) -> list[float]:
    """(16,) of (4, 4), in libfranka's order."""
    return np.asarray(matrix, dtype=np.float64).flatten(order="F").tolist()
