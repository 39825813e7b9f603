"""Palletizing in the simulated cell with the shipped model."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hal import Cell, GraspResult, execute_grasp
from hal.errors import CommunicationLost
from mskgrasp.core.errors import BadModel, UsageError
from mskgrasp.core.grasp import Grasp
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.palletize.__main__ import main
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.run import SCENE_VERSION, palletize
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.runtime.run_folder import INPUTS
from tests.browser import Page
from tests.hal.test_operator import REAL

REPOSITORY = Path(__file__).parents[2]
PART = "t_nut_m16x18"


def config(out: Path, **changes: object) -> PalletizeConfig:
    values: dict[str, object] = dict(
        models=PRETRAINED, out=out, parts=(PART,), trials=1, corrections=("none", "truth"),
        planner=PlannerConfig(n_candidates=400),
    )  # fmt: skip
    return PalletizeConfig(**(values | changes))  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_run_whose_cell_was_lost_is_resumed_and_reported(tmp_path, monkeypatch, capsys):
    out = tmp_path / "run"
    grasped: list[Grasp] = []

    def pulled_cable(cell: Cell, grasp: Grasp, **settings: Any) -> GraspResult:
        if grasped:
            raise CommunicationLost("no answer from the arm")
        grasped.append(grasp)
        return execute_grasp(cell, grasp, **settings)

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
        (dict(slots="within.yaml"), UsageError, r"slot 1 at \(0.5, 0\) m is nearer than 0.05 m to"),
        (dict(slots="beside.yaml"), UsageError, rf"{PART} in the slot at \(0.5, 0.175\) m is nearer than"),
        (dict(cell="mujoco.yaml", tape=(0.012, 0.008)), UsageError, "mujoco.yaml draws no tape on parts"),
        (dict(slots="none.yaml", parts=("no_such_part",)), UsageError, "cannot read .*none.yaml"),
        (dict(cell="none.yaml", parts=("no_such_part",)), UsageError, "cannot read .*none.yaml"),
        (dict(cell="real.yaml"), UsageError, "standard input is no terminal"),
        (dict(cell="real.yaml", yes=True, workers=2), UsageError, "--workers 2: .* is one cell"),
        (dict(cell="real.yaml", yes=True, corrections=("truth",)), UsageError, "no tracker; legal: none"),
    ],
)  # fmt: skip
def test_an_impossible_run_is_refused_before_anything_moves(tmp_path, monkeypatch, changes, error, message):
    (tmp_path / "small.yaml").write_text("slots: [{x: 0.5, y: 0.2, size: [0.02, 0.03]}]")
    (tmp_path / "within.yaml").write_text("slots: [{x: 0.5, y: 0.0}]")
    (tmp_path / "beside.yaml").write_text("slots: [{x: 0.5, y: 0.175}]")
    (tmp_path / "mujoco.yaml").write_text("type: mujoco")
    (tmp_path / "real.yaml").write_text(yaml.safe_dump(REAL))
    monkeypatch.setattr("sys.stdin", io.StringIO())
    files = {name: tmp_path / value for name, value in changes.items() if name in ("slots", "cell")}
    with pytest.raises(error, match=message) as caught:
        palletize(config(tmp_path / "out", **(changes | files)))
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


def test_parts_beyond_the_slots_of_all_pallets_are_told(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text("slots: [{x: 0.5, y: 0.2, size: [0.02, 0.03]}]")
    with pytest.raises(UsageError, match="is smaller than"):
        palletize(config(tmp_path / "out", slots=tmp_path / "small.yaml", parts=(PART, "hex_nut_m48")))
    assert (
        f"1 of 2 parts are not tried: {tmp_path / 'small.yaml'} has room for 1, and"
        in capsys.readouterr().err
    )
