"""Time of checking a motion against what it must keep out of. Run: python -m tests.benchmarks.motion_check.

Of processor time: an arm that refuses a motion must not keep its caller waiting. Ends with 1 where the best
of the repeats takes longer than `MOST_S`.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from hal.collisions import check_path, line_joints
from hal.keep_out import Capsule, camera_keep_out
from hal.simulated import panda_limits
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import forward_pose
from mskgrasp.core.settings import Overhead
from mskgrasp.runtime import cli

MOST_S = 0.02
"""Most seconds of processor time that a check may take."""
READY = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])


def main() -> int:
    """Prints the best and the median time."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.motion_check",
        description="Measure the time of checking a straight motion past a camera and two posts.",
    )
    parser.add_argument("--repeats", type=int, default=20, help="checks of the motion (default 20)")
    options = parser.parse_args()
    camera = camera_keep_out(Overhead().T_base_camera((0.5, 0.0)))
    posts = [
        Capsule(name="post", ends=np.array([[0.2, y, 0.0], [0.2, y, 1.2]]), radius=0.02) for y in (-0.5, 0.5)
    ]
    limits = replace(panda_limits(), keep_out=(camera, *posts))
    start, goal = forward_pose(READY), pose_base_tcp(np.array([0.6, -0.1, 0.1, 1.2]))
    took = []
    for _ in range(options.repeats):
        begun = time.thread_time()
        check_path(PANDA_LINKS, limits, line_joints(PANDA_LINKS, limits, READY, start, goal), "the line")
        took.append(time.thread_time() - begun)
    print(f"a motion is checked in {1e3 * min(took):.1f} ms (best), {1e3 * np.median(took):.1f} ms (median)")
    return int(min(took) > MOST_S)


if __name__ == "__main__":
    cli.run("motion_check", main)
