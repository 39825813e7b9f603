"""State of an arm, outcome of closing its fingers, and what it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING

HELD_TOLERANCE = 5e-3
"""Fingers that have moved by more since they closed have lost what they held, metres."""


@dataclass(frozen=True, kw_only=True)
class ArmState:
    """State of an arm.

    Attributes:
        joints: (n,) radians.
        T_base_tcp: Measured pose of the TCP in the base.
        gripper_width: Distance between the pads, metres.
        timestamp_s: Time of the measurement, seconds on the monotonic clock of this machine.
        grasped: Whether the hand itself reports a grasp; None where it reports nothing. `Arm.holds` decides.
        max_width: Greatest distance between the pads that this hand reaches, metres; that of its
            `GripperSpec` where it does not know its own before homing.
    """

    joints: np.ndarray
    T_base_tcp: Pose
    gripper_width: float
    timestamp_s: float
    grasped: bool | None = None
    max_width: float = MAX_OPENING


@dataclass(frozen=True, kw_only=True)
class GraspOutcome:
    """Outcome of closing the fingers.

    Attributes:
        width: Distance between the pads, metres.
        holding: Whether something is between them, by `Arm.holds`.
    """

    width: float
    holding: bool


@dataclass(frozen=True, kw_only=True)
class Held:
    """Something in the hand.

    Attributes:
        T_base_tcp: Pose of the TCP when the fingers closed on it; None: an earlier program closed them.
        width: Distance between the pads then, metres.
    """

    T_base_tcp: Pose | None
    width: float

    def lost(self, width: float) -> bool:
        """Whether pads at a distance of ``width`` metres have moved too far since to hold it still."""
        return abs(width - self.width) > HELD_TOLERANCE
