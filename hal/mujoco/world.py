"""Simulated world shared by camera, arm, feeder and tracker of a cell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hal.errors import DriverMissing, NotConnected
from hal.mujoco.config import MujocoPhysics
from hal.simulated import SimulatedWorld
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import TABLE_Z
from mskgrasp.parts import Part
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.parts.resting_pose import random_resting_pose

if TYPE_CHECKING:
    from hal.mujoco.simulation import Simulation

_FALLEN = 0.05
"""A part this far below the table has fallen off it, m."""


@dataclass(kw_only=True, eq=False)
class MujocoWorld(SimulatedWorld):
    """Parts on a table under a Panda; built when first connected.

    Attributes:
        physics: Settings of the simulation.
    """

    physics: MujocoPhysics
    _simulation: Simulation | None = field(default=None, init=False)

    @property
    def simulation(self) -> Simulation:
        """The simulation.

        Raises:
            NotConnected: No device of this cell is connected.
        """
        if self._simulation is None:
            raise NotConnected("the simulated cell is closed; use it inside open_cell(...)")
        return self._simulation

    def _build(self) -> None:
        if self._simulation is None:
            self.present(self.part, self.seed)

    def _free(self) -> None:
        self._simulation = None

    def _place(self, part: Part, seed: int, keep: bool) -> None:
        corners = np.concatenate(hull_corners(part))
        drawn = random_resting_pose(
            part.resting, part.resting_probability, corners, self.region, np.random.RandomState(seed)
        )
        pose, moved = Pose.from_vector(drawn), self.table_motion
        staying = self._outside() if keep else []
        self._simulation = _simulation()(
            self.physics,
            [part, *(one for one, _ in staying)],
            [pose if moved is None else moved @ pose, *(pose for _, pose in staying)],
            self.home,
            moved,
        )
        self._simulation.watch = self.call_watch

    def part_pose(self) -> Pose:
        """``T_base_obj`` of the part, the simulator's ground truth."""
        return self.simulation.part_pose()

    def _outside(self) -> list[tuple[Part, Pose]]:
        """Parts on the table outside the region, with their poses."""
        x_min, x_max, y_min, y_max = self.region
        found = []
        for i, part in enumerate(self.simulation.parts):
            pose = self.simulation.part_pose(i)
            x, y, z = pose.position
            if z > TABLE_Z - _FALLEN and not (x_min <= x <= x_max and y_min <= y <= y_max):
                found.append((part, pose))
        return found


def _simulation() -> type[Simulation]:
    try:
        from hal.mujoco.simulation import Simulation
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise DriverMissing("this cell needs the package mujoco; run: EXTRAS=dev,mujoco .ci/setup") from error
    return Simulation
