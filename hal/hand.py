"""The hand of an arm: whether it holds something, what it holds, and how the robot is configured for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def holds(width: float, grasped: bool | None, closed_width: float) -> bool:
    """Whether the fingers hold something: one rule, for the moment of closing and after the lift.

    Args:
        width: Measured distance of the pads, metres.
        grasped: What the hand itself reports (libfranka's ``is_grasped``); None where it reports nothing.
        closed_width: Pads at this distance or less hold nothing, metres: a hand that closes on air may
            report a grasp of width 0.
    """
    return grasped is not False and width > closed_width


@dataclass(frozen=True, kw_only=True)
class Load:
    """A part in the hand, as a robot that compensates its weight must know it.

    Attributes:
        mass: kg.
        centre_tcp: (3,) centre of mass in the tcp frame, metres.
        inertia: (3, 3) about the centre of mass, axes of the tcp frame, kg m^2.

    Raises:
        ValueError: A value is not finite, or the mass not positive.
    """

    mass: float
    centre_tcp: np.ndarray
    inertia: np.ndarray

    def __post_init__(self) -> None:
        shapes = np.shape(self.centre_tcp), np.shape(self.inertia)
        if shapes != ((3,), (3, 3)):
            raise ValueError(f"centre_tcp and inertia must be (3,) and (3, 3), got {shapes[0]}, {shapes[1]}")
        if not np.isfinite([self.mass, *self.centre_tcp, *np.ravel(self.inertia)]).all() or self.mass <= 0:
            raise ValueError(f"a load must be finite and its mass over 0, got {self.mass} kg")


@dataclass(frozen=True, kw_only=True)
class ConfiguredHand:
    """End effector that a robot is configured for (in Desk).

    Attributes:
        mass: kg.
        centre_flange: (3,) centre of mass in the flange, metres.
        load_mass: Mass of the part that the robot was told to be in the hand, kg; 0 for none.
    """

    mass: float
    centre_flange: np.ndarray
    load_mass: float
