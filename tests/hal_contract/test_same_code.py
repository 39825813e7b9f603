"""The same program on two cells: SAPIEN's arm, and an FR3 that franky drives over the real wire protocol.

Camera and scene are the same rendered ones, so the plans are the same, and so must the commands be that
the arm receives, to the last digit, apart from what a program derives from where the arm says that it stands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hal import Cell, cell_from_yaml, execute_grasp, go_home
from hal.arm import POSITION_TOLERANCE, ROTATION_TOLERANCE, Arm
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING, pose_base_tcp
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from tests.hal.franka.robots import franky_sim, write_cell
from tests.hal_contract.conftest import CELLS

PART, SEED = "hex_nut_m30", 5
PLACE = np.array([0.45, -0.1])
"""Where the part is put down, base frame, m."""
COMMANDS = ("move_to_joints", "move_to_pose", "move_gripper", "grasp", "wait")


def record(arm: Arm, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any, dict[str, Any]]]:
    """Every command that the arm is given from now on."""
    seen: list[tuple[str, Any, dict[str, Any]]] = []

    def listen(name: str) -> None:
        command = getattr(arm, name)

        def recorded(*args: Any, **settings: Any) -> Any:
            seen.append((name, args[0], settings))
            return command(*args, **settings)

        monkeypatch.setattr(arm, name, recorded)

    for name in COMMANDS:
        listen(name)
    return seen


def pick_and_place(cell: Cell, planner: Planner) -> np.ndarray:
    """The program: it uses a cell and a planner, independent of the backend."""
    assert cell.feeder is not None
    cell.arm.move_to_joints(cell.workspace.home)
    cell.feeder.present(PART, SEED)
    plan = planner.plan(cell.camera.capture(), np.random.default_rng(SEED))
    result = execute_grasp(cell, plan.grasp)
    assert result.holding, result
    place = np.array([*PLACE, plan.grasp.position[2] + 0.003, 0.0])
    above = place + np.array([0.0, 0.0, cell.workspace.lift_height, 0.0])
    cell.arm.move_to_pose(pose_base_tcp(above), speed=0.25)
    cell.arm.move_to_pose(pose_base_tcp(place), speed=0.15)
    cell.arm.move_gripper(MAX_OPENING)
    go_home(cell)
    return plan.grasp.as_vector()


@pytest.mark.slow
def test_the_same_program_sends_the_same_commands_to_both_arms(tmp_path: Path, monkeypatch):
    torch.manual_seed(0)
    models = load_models(PRETRAINED)
    commands, grasps = [], []
    planner = None
    with franky_sim() as robot:
        # The simulated FR3 stands upright at first: its straight way home leads through the camera.
        blind = cell_from_yaml(write_cell(tmp_path, "franky", robot.host))
        with blind.arm:
            blind.arm.move_to_joints(blind.workspace.home, speed=1.0)
        for path in (CELLS / "sapien.yaml", write_cell(tmp_path, "franky", robot.host, {"driver": "sapien"})):
            cell = cell_from_yaml(path)
            if planner is None:
                planner = Planner.of_workspace(models, PlannerConfig(n_candidates=200), cell.workspace)
            with cell.connected():
                if len(commands) == 1:
                    robot.order("part 0.046")  # the nut is 46 mm across its flats
                commands.append(record(cell.arm, monkeypatch))
                grasps.append(pick_and_place(cell, planner))

    assert grasps[0].tolist() == grasps[1].tolist()
    assert [name for name, _, _ in commands[0]] == [name for name, _, _ in commands[1]]
    assert len(commands[0]) > 10
    derived = 0
    for (name, first, how), (_, second, how_too) in zip(*commands, strict=True):
        assert how == how_too
        if isinstance(first, Pose):
            if first.as_vector().tolist() == second.as_vector().tolist():
                continue
            # The retreat of go_home begins where the arm stands, and that is measured.
            derived += 1
            assert np.linalg.norm(first.position - second.position) < 2 * POSITION_TOLERANCE
            assert abs(np.dot(first.quat_wxyz, second.quat_wxyz)) > np.cos(ROTATION_TOLERANCE)
        else:
            assert np.asarray(first).tolist() == np.asarray(second).tolist(), name
    assert derived == 1
