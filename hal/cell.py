"""Cell: an arm and a camera at a table, and the workspace they share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hal.arm import Arm
from hal.camera import Camera
from hal.limits import PAD_CORNER, plane_height
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PAD_REACH, TABLE_CLEARANCE


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """The table in front of the arm.

    Attributes:
        table_z: Height of the table in the region's middle, base frame, metres.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        home: (n,) joints at which the arm is out of the camera's sight, radians.
        min_height: Points lower than this over the table count as table, metres.
        lift_height: Height by which a grasped part is lifted, metres.
        grasp_force: Gripper force, N.
        clearance: Least distance of the pads from the table, metres.
        table_slope: Rise of the table along x and along y, metres a metre.
    """

    table_z: float
    region: tuple[float, float, float, float]
    home: np.ndarray
    min_height: float
    lift_height: float
    grasp_force: float
    clearance: float = TABLE_CLEARANCE
    table_slope: tuple[float, float] = (0.0, 0.0)

    @property
    def centre(self) -> np.ndarray:
        """(2,) middle of the region, base frame, metres."""
        x_min, x_max, y_min, y_max = self.region
        return np.array([(x_min + x_max) / 2, (y_min + y_max) / 2])

    @property
    def pads_clearance(self) -> float:
        """Least distance of the middle of the pads from the table, metres.

        On a slope a corner of the pads is nearer to the table than their middle.
        """
        return self.clearance + PAD_CORNER * float(np.linalg.norm(self.table_slope))

    def lowest_tip_z(self, xy: np.ndarray) -> np.ndarray:
        """Least z (...) of the pads' tips at points (..., 2) over the table, metres."""
        return self._table_at(xy) + self.pads_clearance

    def lowest_grasp_z(self, xy: np.ndarray) -> np.ndarray:
        """Least z (...) of grasps of the Franka Hand at points (..., 2) that keep clear of the table, m."""
        return self._table_at(xy) + PAD_REACH + self.pads_clearance

    def _table_at(self, xy: np.ndarray) -> np.ndarray:
        return plane_height(xy, self.table_z, self.table_slope, self.centre)


class PartFeeder(Protocol):
    """Feeder that places parts on the table, such as a simulator."""

    def present(self, part: str, seed: int, *, keep: bool = False) -> None:
        """Place a part at a position and turn determined by the seed.

        A simulated feeder takes away what the hand holds and leaves the arm at home.

        Args:
            part: Name or folder.
            seed: Determines position and turn.
            keep: Parts outside the region, such as on a pallet, stay; else the table is cleared.
        """
        ...


class PartTracker(Protocol):
    """Source of the part's pose: the simulator's ground truth, or markers on a real part."""

    def part_pose(self) -> Pose:
        """Current ``T_base_obj``."""
        ...


class BoardHolder(Protocol):
    """Holder that attaches a calibration board to the hand; on a real cell an operator does."""

    def hold_board(self, image: np.ndarray, size: tuple[float, float], T_tcp_board: Pose) -> None:
        """Fix a flat board to the hand until the next part is presented.

        Args:
            image: (h, w) uint8 grey levels of the printed side.
            size: Its width and height, metres.
            T_tcp_board: Board in the tcp frame: origin in its middle, x right and y down as read, z into it.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Camera, arm and workspace, with optional feeder, tracker and board holder.

    Attributes:
        camera: Camera over the table.
        arm: Arm beside the table.
        workspace: Table and default settings.
        feeder: Places parts on the table; None if an operator does.
        tracker: Measures the part's pose; None if nothing does.
        board_holder: Attaches a calibration board to the hand; None if an operator does.
        simulated: The cell is a simulation of its own, so that several may run at once.
        draws_tape: The file may ask for tape on parts (``tape``) and fine colour (``colour_scale``).
        physics: Settings of a simulation; None: of a real cell, or unknown.
        recorded: Its calls are recorded or replayed: a program asks it nothing that a run does not need.
    """

    camera: Camera
    arm: Arm
    workspace: Workspace
    feeder: PartFeeder | None = None
    tracker: PartTracker | None = None
    board_holder: BoardHolder | None = None
    physics: Config | None = None
    simulated: bool = False
    draws_tape: bool = False
    recorded: bool = False

    @contextmanager
    def connected(self) -> Iterator[Cell]:
        """Connect camera and arm; release both at the end of the block."""
        with self.camera, self.arm:
            yield self
