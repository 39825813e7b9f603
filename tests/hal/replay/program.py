"""A program on the toy cell, and its recording played back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hal import Cell, execute_grasp
from hal.errors import CaptureFailed, MotionAborted, NeedsRecovery
from hal.replay import ReplayCellConfig, replay_cell
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from tests.hal.replay.toy import DOWN

GRASP = np.array([0.45, 0.05, 0.06, 0.2])


def at(z: float, x: float = 0.4) -> Pose:
    return Pose(position=np.array([x, 0.0, z]), quat_wxyz=DOWN)


def run_on(cell: Cell, log: list[object]) -> None:
    """A program: every verb, every kind of answer, refusals and faults."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("nut", 3)
    log.append(cell.camera.capture().depth.tolist())
    log.append(cell.tracker.part_pose().position.tolist())
    result = execute_grasp(cell, Grasp.from_vector(GRASP))
    cell.arm.move_gripper(0.06)
    log += [result.width, result.holding, result.T_base_tcp.position.tolist()]
    with pytest.raises(MotionAborted, match="contact force"):
        cell.arm.move_to_pose(at(0.03))
    with pytest.raises(NeedsRecovery, match="check the arm"):
        cell.arm.move_gripper(0.05)
    cell.arm.recover()
    cell.arm.move_to_joints(cell.workspace.home, speed=0.2)
    log.append(cell.arm.state().joints.tolist())
    for _ in range(2):
        log.append(cell.camera.capture().colour.tolist())
    with pytest.raises(CaptureFailed, match="no frame within 5 s"):
        cell.camera.capture()
    cell.arm.wait(0.5)
    log.append(cell.camera.capture().depth.tolist())


def replayed(path: Path) -> Cell:
    return replay_cell(ReplayCellConfig(type="replay", recording=path))
