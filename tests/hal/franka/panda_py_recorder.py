"""Record of what the driver on panda_py commands.

``python -m tests.hal.franka.panda_py_recorder HOST PATH OUT`` follows a path stored as JSON. Every command
goes on to the controller of the real wheel and is written to OUT with the robot's time that the driver read.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import panda_py.controllers
from numpy.typing import ArrayLike

from hal.franka.panda_py_driver import PandaPyDriver
from hal.franka.path import JointPath
from tests.hal.franka.robots import driver_settings

SECONDS: list[float] = []
JOINTS: list[np.ndarray] = []
SPEEDS: list[np.ndarray] = []


class RecordedJointPosition(panda_py.controllers.JointPosition):
    """panda_py's controller, which also notes its commands."""

    now = 0.0

    def get_time(self) -> float:
        self.now = super().get_time()
        return self.now

    def set_control(self, position: ArrayLike, velocity: ArrayLike = (0.0,) * 7) -> None:
        SECONDS.append(self.now)
        JOINTS.append(np.array(position))
        SPEEDS.append(np.array(velocity))
        super().set_control(position, velocity)


def main() -> None:
    host, path, out = sys.argv[1:]
    panda_py.controllers.JointPosition = RecordedJointPosition
    driver = PandaPyDriver()
    driver.connect(driver_settings(host))
    values = json.loads(Path(path).read_text())
    driver.move_straight(JointPath(**{key: np.array(values[key]) for key in values}), np.eye(4))
    np.savez(out, seconds=SECONDS, joints=JOINTS, speeds=SPEEDS)
    print(" ".join(str(value) for value in driver.state().joints), flush=True)
    os._exit(0)  # as a driver's process ends


if __name__ == "__main__":
    main()
