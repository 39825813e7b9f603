"""One grasp planned in the simulated cell with the shipped model."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from hal import Cell, open_cell
from hal.arm import JOINT_TOLERANCE
from hal.errors import ArmInView, LoadTooHeavy
from mskgrasp.core.errors import BadConfig, UnknownPart
from mskgrasp.parts import find_part
from mskgrasp.plan.config import PlanConfig
from mskgrasp.plan.run import plan_grasp
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import RECENTRED
from tests.figures import picture

PART = "hex_nut_m30"


def test_a_plan_is_written_with_its_picture_and_a_seed_repeats_it(tmp_path: Path):
    config = PlanConfig(part=PART, out=tmp_path / "plan", seed=4, planner=PlannerConfig(n_candidates=60))
    plan = plan_grasp(config)
    stored = json.loads((config.out / "plan.json").read_text())
    assert stored["seed"] == 4 and 60 < stored["n_candidates"] <= 60 + RECENTRED
    np.testing.assert_allclose(stored["grasp"], plan.grasp.as_vector())
    np.testing.assert_allclose(stored["displacement"], plan.displacement)
    # The part that was asked for lies there: it is as high as one of its own edges is long.
    assert np.abs(find_part(PART).extents - stored["part"]["size"][2]).min() < 1e-3
    assert picture(config.out / "plan.png").shape[1] > 1000
    again = plan_grasp(config)
    np.testing.assert_array_equal(again.grasp.as_vector(), plan.grasp.as_vector())


def test_no_grasp_is_planned_while_the_arm_may_be_in_view_unless_it_goes_home(tmp_path: Path, monkeypatch):
    """The simulated arm stands at home when the cell is opened."""
    off_home: list[np.ndarray] = []

    @contextmanager
    def away(path: Path) -> Iterator[Cell]:
        with open_cell(path) as cell:
            cell.arm.move_to_joints(cell.workspace.home + np.array([0.3, 0, 0, 0, 0, 0, 0]))
            try:
                yield cell
            finally:
                off_home.append(cell.arm.state().joints - cell.workspace.home)

    monkeypatch.setattr("mskgrasp.plan.run.open_cell", away)
    config = PlanConfig(out=tmp_path / "plan", planner=PlannerConfig(n_candidates=60))
    with pytest.raises(ArmInView, match="joint 1 is 0.30 rad from home"):
        plan_grasp(config)
    assert not (config.out / "plan.json").exists()
    plan_grasp(config.model_copy(update={"go_home": True}))
    assert (config.out / "plan.json").exists()
    assert off_home[0] == pytest.approx([0.3, 0, 0, 0, 0, 0, 0], abs=JOINT_TOLERANCE)
    assert off_home[1] == pytest.approx(np.zeros(7), abs=JOINT_TOLERANCE)


def test_a_part_that_the_arm_cannot_carry_gets_no_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    heavy = dataclasses.replace(find_part(PART), mass=4.2)
    monkeypatch.setattr("mskgrasp.plan.run.find_part", lambda _: heavy)
    with pytest.raises(LoadTooHeavy, match=r"the part weighs 4\.200 kg, this arm carries"):
        plan_grasp(PlanConfig(part=PART, out=tmp_path / "plan"))
    assert not (tmp_path / "plan" / "plan.json").exists()


def test_an_unknown_part_and_an_unknown_cell_are_refused_and_nothing_is_written(tmp_path: Path):
    with pytest.raises(UnknownPart, match="hex_nut_m3o"):
        plan_grasp(PlanConfig(part="hex_nut_m3o", out=tmp_path / "plan"))
    (tmp_path / "cell.yaml").write_text("type: nowhere")
    with pytest.raises(BadConfig, match="'type' is 'nowhere'; legal: sapien"):
        plan_grasp(PlanConfig(cell=tmp_path / "cell.yaml", out=tmp_path / "plan"))
    assert not (tmp_path / "plan" / "plan.json").exists()
