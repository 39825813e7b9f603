"""A cell: a camera over a table, an arm beside it, and what is known about both."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hal.arm import Arm
from hal.camera import Camera
from mskgrasp.core.geometry import Pose


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """The table in front of the arm.

    Attributes:
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        home: (7,) joints at which the arm is out of the camera's sight, radians.
        min_height: What rises less over the table is taken for table, metres.
        lift_height: How far a grasped part is lifted, metres.
        grasp_force: N.
    """

    table_z: float
    region: tuple[float, float, float, float]
    home: np.ndarray
    min_height: float
    lift_height: float
    grasp_force: float


class PartFeeder(Protocol):
    """Lays parts on the table: a simulator by itself, on a real cell an operator."""

    def present(self, part: str, seed: int, *, keep: bool = False) -> None:
        """Lays the part, by name or folder, at a place and turn that follow from the seed.

        Args:
            part: Name or folder.
            seed: Its place and turn follow from it.
            keep: What was put outside the region, as on a pallet, stays there; else the table is cleared.
        """
        ...


class PartTracker(Protocol):
    """Knows where the part is: the simulator's truth, or markers on a real part."""

    def part_pose(self) -> Pose:
        """``T_base_obj`` now."""
        ...


class BoardHolder(Protocol):
    """Puts a calibration board into the hand: a simulator by itself, on a real cell an operator."""

    def hold_board(self, image: np.ndarray, size: tuple[float, float], T_tcp_board: Pose) -> None:
        """Fixes a flat board to the hand until the next part is presented.

        Args:
            image: (h, w) grey levels of its printed side, uint8.
            size: Its width and height, metres.
            T_tcp_board: Origin in its middle, x right and y down as it is read, z into it.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Everything a program needs; a context manager that connects camera and arm.

    Attributes:
        camera: Looks down on the table.
        arm: Stands beside it.
        workspace: The table.
        feeder: Lays parts on the table; None where nobody does.
        tracker: Knows the part's pose; None where nothing does.
        board_holder: Puts a calibration board into the hand; None where an operator does.
    """

    camera: Camera
    arm: Arm
    workspace: Workspace
    feeder: PartFeeder | None = None
    tracker: PartTracker | None = None
    board_holder: BoardHolder | None = None

    @contextmanager
    def connected(self) -> Iterator[Cell]:
        """Connects camera and arm, and releases both however the block ends."""
        with self.camera, self.arm:
            yield self
