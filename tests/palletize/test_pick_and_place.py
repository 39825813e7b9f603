"""Pick and place in the simulated cell."""

from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest

from hal.errors import MotionAborted, OutOfWorkspace
from hal.operator import Operator, StoppedByOperator
from hal.sim import SapienCellConfig, sapien_cell
from mskgrasp.core.errors import NoPartFound
from mskgrasp.core.settings import Tape
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.palletize import pick_and_place
from mskgrasp.palletize.figures import pallet_image
from mskgrasp.palletize.height_maps import read_height_maps, write_height_maps
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.pick_and_place import PickAndPlace, PlacementTask
from mskgrasp.palletize.placement_records import placement_name
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.trials.engine import TrialEngine

PART = "t_nut_m16x18"
TAPED = "u_bracket_60x35"
"""Has room for two squares of tape."""


class SimulatedOperator(io.StringIO):
    """Operator who places the part when asked to and answers the questions."""

    def __init__(self, place, answers: str):
        super().__init__()
        self._place = place
        self._answers = iter(answers)

    def readline(self, *_: object) -> str:  # type: ignore[override]
        answer = next(self._answers, "")
        if answer == "\n":
            self._place()
        return answer if answer in ("", "\n") else answer + "\n"


@pytest.mark.slow
def test_without_feeder_and_tracker_an_operator_places_parts_and_tape_measures(tmp_path, monkeypatch):
    """As on a real cell: the operator confirms every motion, and two tape squares measure the error."""
    tape = Tape(large=0.012, small=0.008)
    whole = sapien_cell(SapienCellConfig(type="sapien", part=TAPED, tape=tape, colour_scale=3))
    monkeypatch.setattr(type(whole.arm), "simulated", False)
    cell = dataclasses.replace(whole, feeder=None, tracker=None)
    assert whole.feeder is not None and whole.tracker is not None
    feeder, tracker, prompts = whole.feeder, whole.tracker, io.StringIO()
    hands = SimulatedOperator(lambda: feeder.present(TAPED, 5), "\nn\ny\nyq")
    operator = Operator(cell, answers=hands, prompts=prompts)
    task = PlacementTask(
        part=TAPED, number=0, index=0, slot=Slot(x=0.52, y=0.05, theta=1.0), correction="predicted", seed=5,
        keep=False,
    )  # fmt: skip
    (tmp_path / "placements").mkdir()
    with cell.connected():
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=100), cell)
        picture = tmp_path / "next.png"
        taped = TrialEngine(cell, operator, picture=picture, tape=tape)
        placed = PickAndPlace(taped, planner, tmp_path).run(task)
        true = tracker.part_pose()
        bare = PickAndPlace(TrialEngine(cell, operator, picture=picture), planner, tmp_path)
        unknown = bare.run(task)
        with pytest.raises(StoppedByOperator):
            bare.run(task)
    assert prompts.getvalue().count("Shake the part") == 4  # repeated after the n
    assert prompts.getvalue().count("May the arm move?") == 3
    assert (tmp_path / "next.png").exists()
    assert placed.placed and placed.measured is None and placed.unmeasured == ""
    # The origin is within some millimetres of the detected centre.
    assert placed.translation_error is not None
    assert np.hypot(*(true.position[:2] - [0.52, 0.05])) == pytest.approx(placed.translation_error, abs=4e-3)
    assert unknown.placed and unknown.translation_error is None and "--tape" in unknown.unmeasured


def test_a_part_that_was_released_is_not_placed_again_and_one_that_is_not_seen_is_reported(
    tmp_path, monkeypatch
):
    """The hand that should rise cannot: out of reach, or stopped by a contact."""
    calls: list[Exception] = []

    def stopped(error: Exception):
        def place(cell, pose, recover, *, arrived, **settings):
            calls.append(error)
            arrived()
            raise error

        return place

    cell = sapien_cell(SapienCellConfig(type="sapien", part=PART))
    task = PlacementTask(
        part=PART, number=0, index=2, slot=Slot(x=0.5, y=0.06, theta=0.0), correction="none", seed=5,
        keep=False,
    )  # fmt: skip
    (tmp_path / "placements").mkdir()
    with cell.connected():
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=100), cell)
        engine = TrialEngine(cell, Operator(cell, yes=True), picture=tmp_path / "next.png")
        worker = PickAndPlace(engine, planner, tmp_path)
        monkeypatch.setattr(pick_and_place, "place", stopped(OutOfWorkspace("too high")))
        with pytest.raises(OutOfWorkspace, match="too high"):
            worker.run(task)
        assert len(calls) == 1
        monkeypatch.setattr(pick_and_place, "place", stopped(MotionAborted("contact")))
        assert worker.run(task).reason == "collided" and len(calls) == 2
        assert 0.01 < worker._tops[2] < 0.03  # the nut stands there

        def unseen(frame, **settings):
            raise NoPartFound("nothing rises")

        monkeypatch.setattr(pick_and_place, "seen_footprint", unseen)
        assert worker.run(task).reason == "no part found" and len(calls) == 2


@pytest.mark.slow
def test_the_picture_of_a_pallet_whose_first_part_failed_uses_no_heights_of_the_previous_pallet(tmp_path):
    cell = sapien_cell(SapienCellConfig(type="sapien", part=PART))
    slots = [Slot(x=0.5, y=0.06, theta=0.0, size=(0.09, 0.08))]
    placed = PlacementTask(part=PART, number=0, index=0, slot=slots[0], correction="none", seed=5, keep=False)
    too_small = dataclasses.replace(placed, number=1, slot=Slot(x=0.5, y=0.06, theta=0.0, size=(0.02, 0.02)))
    (tmp_path / "placements").mkdir()
    with cell.connected():
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=100), cell)
        engine = TrialEngine(cell, Operator(cell, yes=True), picture=tmp_path / "next.png")
        worker = PickAndPlace(engine, planner, tmp_path)
        assert worker.run(placed).placed
        flat = pallet_image(cell.camera.capture(), slots, cell.workspace.table_z, {})
        assert not np.array_equal(worker.picture(slots), flat)
        resumed = PickAndPlace(engine, planner, tmp_path)
        resumed.skip(placed)
        np.testing.assert_array_equal(resumed.picture(slots), worker.picture(slots))
        maps = tmp_path / "placements" / f"{placement_name(placed.key)}.npz"
        emptied = dataclasses.replace(read_height_maps(maps), after=np.zeros((0, 0)))
        write_height_maps(emptied, maps.with_name(f"{placement_name(too_small.key)}.npz"))
        resumed.skip(dataclasses.replace(too_small, keep=True))  # grasped, and not placed
        np.testing.assert_array_equal(resumed.picture(slots), worker.picture(slots))
        assert worker.run(too_small).reason == "slot too small"
        resumed.skip(too_small)
        flat = pallet_image(cell.camera.capture(), slots, cell.workspace.table_z, {})
        np.testing.assert_array_equal(worker.picture(slots), flat)
        np.testing.assert_array_equal(resumed.picture(slots), flat)
