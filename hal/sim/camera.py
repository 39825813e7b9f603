"""The overhead depth camera of the simulated cell."""

from __future__ import annotations

import numpy as np

from hal.sim.world import SapienWorld
from hal.simulated import SimulatedCamera


class SapienCamera(SimulatedCamera[SapienWorld]):
    """Rendered camera over the table; it sees the arm, too."""

    serial = "sapien"
    rendered = True

    def _render(self) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        colour, depth = self._world.env.capture_rgbd(with_robot=True)
        return colour[0].cpu().numpy(), depth[0].cpu().numpy(), self._world.fine_colour()
