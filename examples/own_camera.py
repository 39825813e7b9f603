"""A depth camera of your own: plan a grasp of what it sees.

python examples/own_camera.py
"""

import time

import numpy as np

from hal import Camera, RgbdFrame
from mskgrasp import Planner, PlannerConfig, Pose, load_models

REGION = (0.38, 0.62, -0.12, 0.12)  # where parts lie: x_min, x_max, y_min, y_max, base frame, metres


class BlockCamera(Camera):
    """Looks straight down, from 0.8 m, at a block of 60 x 30 x 40 mm on a flat table."""

    # A real camera opens its driver in connect and lets go of it in close.
    def connect(self): ...
    def close(self): ...

    def capture(self, timeout_s=5.0):
        depth = np.full((160, 160), 0.8, np.float32)  # metres; NaN where the camera sees nothing
        depth[70:84, 66:94] = 0.76
        return RgbdFrame(
            colour=np.zeros((160, 160, 3), np.uint8),
            depth=depth,
            intrinsics=np.array([[365.0, 0.0, 79.5], [0.0, 365.0, 79.5], [0.0, 0.0, 1.0]]),
            T_base_camera=Pose(position=np.array([0.5, 0.0, 0.8]), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0])),
            timestamp_s=time.monotonic(),
            serial="1",
        )


def plan_grasp(frame):
    planner = Planner(load_models(), PlannerConfig(), table_z=0.0, region=REGION)
    return planner.plan(frame, np.random.default_rng(0))


if __name__ == "__main__":
    with BlockCamera() as camera:
        print(plan_grasp(camera.capture()).summary)
