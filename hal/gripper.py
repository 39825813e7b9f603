"""Dimensions and ranges of a parallel gripper, as limits and a model's hand are compared with them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mskgrasp.core.grasp import (
    FINGER_HALF_WIDTH,
    FINGER_THICKNESS,
    MAX_OPENING,
    PAD_REACH,
)


@dataclass(frozen=True, kw_only=True)
class GripperSpec:
    """Parallel gripper in the tcp frame: z out of the hand, y the closing direction, origin between the pads.

    Attributes:
        stroke: Distance between the pads of the open hand, metres.
        pad_half_width: Half the width of a pad's box along x, metres.
        pad_thickness: Size of a pad's box along y, from its face outwards, metres.
        pad_reach: Reach of the pads beyond the TCP along z, metres.
        finger_thickness: Distance from a pad's face to the back of the finger, metres.
        palm_half_size: Half the size of the palm's box along x and y, metres.
        palm_height: Height of the palm's lower face over the TCP, metres.
        force: Least and greatest force of the gripper, N.
        speed: Least and greatest speed of the pads, m/s.
    """

    stroke: float
    pad_half_width: float
    pad_thickness: float
    pad_reach: float
    finger_thickness: float
    palm_half_size: tuple[float, float]
    palm_height: float
    force: tuple[float, float]
    speed: tuple[float, float]

    @cached_property
    def corners(self) -> np.ndarray:
        """(8, 3) lower corners of the open pads and of the palm, tcp frame, metres."""
        pads = (self.pad_half_width, self.stroke / 2 + self.pad_thickness, self.pad_reach)
        palm = (*self.palm_half_size, -self.palm_height)
        return np.array([[x * dx, y * dy, z] for dx, dy, z in (pads, palm) for x in (-1, 1) for y in (-1, 1)])

    @property
    def geometry(self) -> dict[str, float]:
        """The dimensions that datasets and models store, `mskgrasp.core.grasp.HAND_GEOMETRY`, metres."""
        return {
            "pad_reach": self.pad_reach,
            "max_opening": self.stroke,
            "finger_half_width": self.pad_half_width,
            "finger_thickness": self.finger_thickness,
            "palm_height": self.palm_height,
        }


FRANKA_HAND = GripperSpec(
    stroke=MAX_OPENING,
    pad_half_width=FINGER_HALF_WIDTH,
    pad_thickness=0.016,
    pad_reach=PAD_REACH,
    finger_thickness=FINGER_THICKNESS,
    palm_half_size=(0.032, 0.102),
    palm_height=0.0375,
    force=(0.0, 70.0),
    speed=(0.0, 0.1),
)
"""The Franka Hand: collision boxes of the Panda's hand; stroke, force and speed of its datasheet."""
