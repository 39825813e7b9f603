"""Check of both simulators: a function is called while their arm moves."""

from __future__ import annotations

import numpy as np

from hal import Cell
from hal.simulated import JOINT_SPEED, WATCH_S, SimulatedArm


def check_watching(cell: Cell) -> None:
    """Who watches a motion sees the arm on its way, and nothing afterwards."""
    arm = cell.arm
    assert isinstance(arm, SimulatedArm)
    arm.recover()
    arm.move_to_joints(cell.workspace.home)
    seen: list[float] = []
    arm.watch(lambda: seen.append(arm.state().joints[0] - cell.workspace.home[0]))
    try:
        arm.move_to_joints(cell.workspace.home + np.array([0.3, 0, 0, 0, 0, 0, 0]), speed=0.3)
    finally:
        arm.watch(None)
    n = len(seen)
    on_the_way = [angle for angle in seen if 0.03 < angle < 0.27]
    assert len(on_the_way) >= 10 and np.diff(on_the_way).min() > 0
    assert max(np.diff(on_the_way)) < 0.3 * JOINT_SPEED * 2 * WATCH_S
    arm.move_to_joints(cell.workspace.home)
    assert len(seen) == n
