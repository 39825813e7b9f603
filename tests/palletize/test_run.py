"""Palletizing in the simulated cell with the shipped model."""

from __future__ import annotations

import dataclasses
import io
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from hal import Cell, GraspResult, execute_grasp
from hal.errors import CommunicationLost
from hal.operator import Operator, StoppedByOperator
from hal.sim import SapienCellConfig, sapien_cell
from mskgrasp.core.errors import BadModel, UsageError
from mskgrasp.core.grasp import Grasp
from mskgrasp.core.settings import Tape
from mskgrasp.learning.grasp_models import PRETRAINED
from mskgrasp.palletize.__main__ import main
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.figures import pallet_image
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.pick_and_place import PickAndPlace, PlacementTask
from mskgrasp.palletize.run import SCENE_VERSION, palletize
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.planner import PlannerConfig
from mskgrasp.runtime.run_folder import INPUTS
from mskgrasp.trials.engine import TrialEngine
from tests.browser import Page
from tests.hal.test_operator import REAL

REPOSITORY = Path(__file__).parents[2]
PART = "t_nut_m16x18"
TAPED = "u_bracket_60x35"
"""Has room for two squares of tape."""


@pytest.fixture(autouse=True)
def threads() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)  # the program sets one


def config(out: Path, **changes: object) -> PalletizeConfig:
    values: dict[str, object] = dict(
        models=PRETRAINED, out=out, parts=(PART,), trials=1, corrections=("none", "truth"),
        planner=PlannerConfig(n_candidates=400),
    )  # fmt: skip
    return PalletizeConfig(**(values | changes))  # type: ignore[arg-type]


def test_a_run_whose_cell_was_lost_is_resumed_and_reported(tmp_path, monkeypatch, capsys):
    out = tmp_path / "run"
    grasped: list[Grasp] = []

    def pulled_cable(cell: Cell, grasp: Grasp) -> GraspResult:
        if grasped:
            raise CommunicationLost("no answer from the arm")
        grasped.append(grasp)
        return execute_grasp(cell, grasp)

    with monkeypatch.context() as patch, pytest.raises(CommunicationLost):
        patch.setattr("mskgrasp.trials.engine.execute_grasp", pulled_cable)
        palletize(config(out))
    kept = (out / "trials.jsonl").read_text()
    assert len(kept.splitlines()) == 1

    command = ["palletize", "--models", str(PRETRAINED), "--out", str(out), "--parts", PART, "--trials", "1"]
    command += ["--corrections", "none", "truth", "--planner.n-candidates", "400"]
    monkeypatch.setattr("sys.argv", command)
    assert main() == 0
    assert "Corrected by the truth" in capsys.readouterr().out
    first = (out / "trials.jsonl").read_text()
    assert first.startswith(kept)
    lines = [json.loads(line) for line in first.splitlines()]
    assert [line["correction"] for line in lines] == ["none", "truth"]
    assert all(line["placed"] for line in lines)
    assert lines[0]["grasp"] == lines[1]["grasp"]
    # Equal grasps displace the part equally; only the place pose differs.
    np.testing.assert_allclose(lines[0]["measured"], lines[1]["measured"], atol=1e-6)
    none, truth = (line["translation_error"] for line in lines)
    shift = float(np.hypot(*lines[0]["measured"][:2]))
    assert none == pytest.approx(shift, abs=1.5e-3) and truth < 1.5e-3

    # A line cut short, as by a kill, is repeated with equal values.
    (out / "trials.jsonl").write_text("\n".join(first.splitlines()[:1]) + '\n{"part": "t_nu')
    report = palletize(config(out))
    assert [json.loads(line) for line in (out / "trials.jsonl").read_text().splitlines()] == lines
    assert report.corrections["truth"].placed == 1

    with pytest.raises(UsageError, match="other inputs.*seed differ"):
        palletize(config(out, seed=1))
    inputs = json.loads((out / INPUTS).read_text())
    assert inputs.pop("scene_version") == SCENE_VERSION
    older = shutil.copytree(out, tmp_path / "older")
    (older / INPUTS).write_text(json.dumps(inputs))
    with pytest.raises(UsageError, match=f"scenes of version 1, this program draws version {SCENE_VERSION}"):
        palletize(config(older))

    with Page(out / "report.html") as page:
        widths = page.evaluate("[...document.images].map(i => i.complete ? i.naturalWidth : 0)")
        assert len(widths) == 4 and min(widths) > 400
        assert page.complaints == []
        assert PART in page.evaluate("document.body.textContent")


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (dict(target="0.9,0,0"), UsageError, r"the target at \(0.9, 0\) m .*outside the workspace"),
        (dict(parts=("no_such_part",)), UsageError, "no_such_part"),
        (dict(models=Path("no/model")), BadModel, "no/model"),
        (dict(slots="small.yaml"), UsageError, rf"slot of 20 x 30 mm is smaller than {PART} \(28 x 28 mm\)"),
        (dict(slots="none.yaml"), UsageError, "cannot read configuration .*none.yaml"),
        (dict(cell="real.yaml"), UsageError, "standard input is no terminal"),
        (dict(cell="real.yaml", yes=True, workers=2), UsageError, "--workers 2: .* is one cell"),
        (dict(cell="real.yaml", yes=True, corrections=("truth",)), UsageError, "no tracker; legal: none"),
    ],
)  # fmt: skip
def test_an_impossible_run_is_refused_before_anything_moves(tmp_path, monkeypatch, changes, error, message):
    (tmp_path / "small.yaml").write_text("slots: [{x: 0.5, y: 0.2, size: [0.02, 0.03]}]")
    (tmp_path / "real.yaml").write_text(yaml.safe_dump(REAL))
    monkeypatch.setattr("sys.stdin", io.StringIO())
    files = {name: tmp_path / value for name, value in changes.items() if name in ("slots", "cell")}
    with pytest.raises(error, match=message) as caught:
        palletize(config(tmp_path / "out", **(changes | files)))
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


def test_a_malformed_target_is_refused(tmp_path):
    with pytest.raises(ValueError, match="target must be x,y,theta"):
        config(tmp_path, target="0.5;0.1;90")


class SimulatedOperator:
    """Operator who places the part when asked to and answers the questions."""

    def __init__(self, place, answers: str):
        self._place = place
        self._answers = iter(answers)

    def readline(self) -> str:
        answer = next(self._answers, "")
        if answer == "\n":
            self._place()
        return answer if answer in ("", "\n") else answer + "\n"


def test_without_feeder_and_tracker_an_operator_places_parts_and_tape_measures(tmp_path, monkeypatch):
    """As on a real cell: the operator confirms every motion, and two tape squares measure the error."""
    tape = Tape(large=0.012, small=0.008)
    whole = sapien_cell(SapienCellConfig(type="sapien", part=TAPED, tape=tape, colour_scale=3))
    monkeypatch.setattr(type(whole.arm), "simulated", False)
    cell = dataclasses.replace(whole, feeder=None, tracker=None)
    assert whole.feeder is not None and whole.tracker is not None
    feeder, tracker, prompts = whole.feeder, whole.tracker, io.StringIO()
    hands = SimulatedOperator(lambda: feeder.present(TAPED, 5), "\nn\ny\nyq")
    operator = Operator(cell, answers=hands, prompts=prompts)  # type: ignore[arg-type]
    task = PlacementTask(
        part=TAPED, number=0, index=0, slot=Slot(x=0.52, y=0.05, theta=1.0), correction="predicted", seed=5,
        keep=False,
    )  # fmt: skip
    (tmp_path / "placements").mkdir()
    with cell.connected():
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=100), cell)
        picture = tmp_path / "next.png"
        taped = TrialEngine(cell, operator, picture=picture, tape=tape)
        placed = PickAndPlace(taped, planner, tmp_path / "placements").run(task)
        true = tracker.part_pose()
        bare = PickAndPlace(TrialEngine(cell, operator, picture=picture), planner, tmp_path / "placements")
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


def test_the_picture_of_a_pallet_whose_first_part_failed_uses_no_heights_of_the_previous_pallet(tmp_path):
    cell = sapien_cell(SapienCellConfig(type="sapien", part=PART))
    slots = [Slot(x=0.5, y=0.06, theta=0.0, size=(0.09, 0.08))]
    placed = PlacementTask(part=PART, number=0, index=0, slot=slots[0], correction="none", seed=5, keep=False)
    too_small = dataclasses.replace(placed, number=1, slot=Slot(x=0.5, y=0.06, theta=0.0, size=(0.02, 0.02)))
    (tmp_path / "placements").mkdir()
    with cell.connected():
        planner = make_planner(PRETRAINED, PlannerConfig(n_candidates=100), cell)
        engine = TrialEngine(cell, Operator(cell, yes=True), picture=tmp_path / "next.png")
        worker = PickAndPlace(engine, planner, tmp_path / "placements")
        assert worker.run(placed).placed
        flat = pallet_image(cell.camera.capture(), slots, cell.workspace.table_z, {})
        assert not np.array_equal(worker.picture(slots), flat)
        assert worker.run(too_small).reason == "slot too small"
        flat = pallet_image(cell.camera.capture(), slots, cell.workspace.table_z, {})
        np.testing.assert_array_equal(worker.picture(slots), flat)
