"""Evaluations in the simulated cell with the shipped model."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal.operator import StoppedByOperator
from hal.sim import SapienArm
from mskgrasp.core.errors import MskgraspError, UsageError
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.evaluate.__main__ import main
from mskgrasp.evaluate.config import EvaluateConfig
from mskgrasp.evaluate.run import estimate, evaluate
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.runtime.run_folder import TRIALS, read_trials
from mskgrasp.simulation import certify_parts
from mskgrasp.simulation.certify import CertifyConfig
from mskgrasp.trials.trial import Trial
from mskgrasp.trials.trial_files import read_trial, trial_file
from tests.boxes import make_box
from tests.browser import Page
from tests.hal.real_cell import measured_cell
from tests.programs import run_here

REPOSITORY = Path(__file__).parents[2]


def config(out: Path, **changes: Any) -> EvaluateConfig:
    values = dict(
        models=PRETRAINED, out=out, parts=("hex_nut_m30",), trials=1, workers=1,
        planner=PlannerConfig(policy="quality", n_candidates=60),
    )  # fmt: skip
    return EvaluateConfig(**(values | changes))


def trials(out: Path) -> dict[str, Trial]:
    return {trial.key: trial for trial in read_trials(out / TRIALS, Trial.from_json)}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trials by one process, with camera noise."""
    out = tmp_path_factory.mktemp("runs") / "alone"
    report = evaluate(config(out, trials=2, noise="kinect2"))
    assert report.summary.overall.trials == 2
    return out


def same(one: Trial, other: Trial) -> bool:
    """Equal except for the planning time."""
    return dict(one.to_json(), planning_s=0) == dict(other.to_json(), planning_s=0)


@pytest.mark.slow
def test_several_processes_resume_a_run_with_equal_trials(alone: Path, tmp_path: Path):
    out, expected = tmp_path / "stopped", trials(alone)
    shutil.copytree(alone, out)
    first = (out / TRIALS).read_text().splitlines(keepends=True)[0]
    (out / TRIALS).write_text(first + '{"part": "hex_nut')  # killed while it wrote the second
    report = evaluate(config(out, trials=3, noise="kinect2", workers=2))
    found = trials(out)
    assert (out / TRIALS).read_text().startswith(first) and list(found) == sorted(found) and len(found) == 3
    for key, trial in expected.items():
        assert same(found[key], trial)
        depths = [read_trial(trial_file(run, key))[0].depth for run in (out, alone)]
        np.testing.assert_array_equal(*depths)
    assert not np.array_equal(*(read_trial(trial_file(out, f"hex_nut_m30-00{k}"))[0].depth for k in (0, 1)))
    assert json.loads(json.dumps(report.to_json())) == json.loads((out / "report.json").read_text())
    assert report.summary.overall.trials == 3 and report.settings["noise"] == "kinect2"
    assert (out / "success.png").exists() and len(list((out / "worst").glob("*.png"))) == 3
    with Page(out / "report.html") as page:
        widths = page.evaluate("[...document.images].map(i => i.complete ? i.naturalWidth : 0)")
        assert len(widths) == 5 and min(widths) > 500  # both figures, and the worst three
        assert page.evaluate("[...document.links].every(a => document.querySelector(a.hash) !== null)")
        assert page.complaints == []


@pytest.mark.slow
def test_a_run_with_other_settings_or_another_model_is_refused_and_a_copy_of_its_own_is_not(
    alone: Path, tmp_path: Path
):
    for changes, what in ((dict(seed=1), "seed"), (dict(noise="off"), "noise, cell")):
        with pytest.raises(UsageError, match=f"{what} differ"):
            evaluate(config(alone, trials=3, **(dict(noise="kinect2") | changes)))
    models = tmp_path / "model"
    shutil.copytree(PRETRAINED, models)
    cell = shutil.copy(SIMULATED_CELL, tmp_path / "cell.yaml")
    stored = (alone / TRIALS).read_bytes()
    evaluate(config(alone, trials=2, noise="kinect2", models=models, cell=cell))
    assert (alone / TRIALS).read_bytes() == stored
    meta = json.loads((models / "model.json").read_text())
    (models / "model.json").write_text(json.dumps(dict(meta, metrics={})))
    with pytest.raises(UsageError, match=r"\(model.json differ\)"):
        evaluate(config(alone, trials=3, noise="kinect2", models=models))


@pytest.mark.slow
def test_an_estimate_counts_the_missing_trials_and_makes_none_of_them(
    alone: Path, capsys: pytest.CaptureFixture[str]
):
    files = sorted(alone.rglob("*"))
    seconds = estimate(config(alone, trials=5, noise="kinect2", workers=2))
    printed = capsys.readouterr().out
    assert "3 of 5 trials are missing" in printed and "with 2 processes" in printed
    assert 0.1 < seconds < 100 and sorted(alone.rglob("*")) == files


@pytest.mark.slow
def test_models_are_compared_and_one_added_later_repeats_no_grasp(collected: Path, tmp_path: Path):
    out, part = tmp_path / "out", "parallel_key_a16x10x56"
    settings = dict(experiment="displacement", parts=(part,), lowess_data=collected)
    report = evaluate(config(out, compare=(f"gcip_mv={PRETRAINED}",), **settings))
    found = trials(out)
    chosen = {f"-{label}{how}" for label in ("gcip_mv", "lowess") for how in ("", "-recentred")}
    assert set(found) == {f"{part}-000{by}" for by in {"", *chosen}}
    frames = [read_trial(trial_file(out, key))[0].depth for key in found]
    assert all(np.array_equal(frames[0], frame) for frame in frames)  # one scene for every policy
    best = found[f"{part}-000"]
    assert best.point_base == best.pose_base_obj[:3]  # what the tracker follows
    if best.measured is not None:
        assert set(best.predictions) == {"gcip_mv", "lowess"}
        assert best.predictions["gcip_mv"].mean == pytest.approx(best.predicted, abs=1e-6)
    assert report.summary.models["gcip_mv"].quality.novel.trials == 1
    assert (out / "displacement.png").exists()

    shutil.copytree(PRETRAINED, tmp_path / "other")
    meta = json.loads((tmp_path / "other" / "model.json").read_text())
    meta["training"]["training_parts"] = [part]
    (tmp_path / "other" / "model.json").write_text(json.dumps(meta))
    both = (f"gcip_mv={PRETRAINED}", f"other={tmp_path / 'other'}")
    report = evaluate(config(out, compare=both, **settings))
    assert set(trials(out)) == {*found, f"{part}-000-other", f"{part}-000-other-recentred"}
    assert same(trials(out)[f"{part}-000-lowess"], found[f"{part}-000-lowess"])
    known = report.summary.models["other"].quality.known
    assert known.trials == 1  # known to this one, novel to the other
    assert known.translation_rmse == report.summary.models["gcip_mv"].quality.novel.translation_rmse


def test_plans_are_made_as_on_a_cell_and_recentred(tmp_path: Path):
    evaluate(config(tmp_path, planner=PlannerConfig(policy="low_variance", n_candidates=60)))
    (key,) = trials(tmp_path)
    _, plan, _ = read_trial(trial_file(tmp_path, key))
    assert plan is not None and len(plan.candidates) > 60


@pytest.mark.slow
def test_tape_agrees_with_the_tracker_or_measures_nothing(tmp_path: Path):
    report = evaluate(
        config(tmp_path / "out", measure="markers", parts=("washer_m36", "parallel_pin_12x60"), trials=1)
    )
    washer, pin = (trials(tmp_path / "out")[f"{part}-000"] for part in ("washer_m36", "parallel_pin_12x60"))
    assert washer.success and washer.measured is not None and washer.true is not None
    off = np.array(washer.measured) - washer.true
    assert np.isnan(off[2]) and np.hypot(*off[:2]) < 0.5e-3 and abs(np.degrees(off[3])) < 0.5
    assert pin.measured is None
    if pin.success:
        assert report.summary.overall.unmeasured == {"no room for tape": 1}
    assert report.summary.overall.measured == 1
    _, plan, after = read_trial(trial_file(tmp_path / "out", washer.key))
    assert after is not None and plan is not None
    np.testing.assert_allclose(washer.point_base, plan.view.centre_base)
    np.testing.assert_allclose(washer.predicted, plan.displacement, atol=1e-9)


def test_a_run_without_a_success_reports_and_its_trial_is_replayed(tmp_path: Path):
    """No candidate has the required quality."""
    out = tmp_path / "out"
    done = run_here(
        main, "--models", str(PRETRAINED), "--parts", "hex_nut_m30", "--trials", "1", "--workers", "1",
        "--out", str(out), "--planner.n-candidates", "20", "--planner.min-quality", "1",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "0 of 1" in done.stdout and "refused 1" in done.stdout and "nan" not in done.stdout
    assert json.loads((out / "report.json").read_text())["overall"]["translation_rmse"] is None
    (refused,) = trials(out).values()
    assert refused.reason == "refused" and refused.grasp is None and 0 < (refused.quality or 0) < 1
    assert "refused, as no grasp was worth trying: 1 of 1 (100%), counted as not lifted" in done.stdout
    again = run_here(main, "--replay", str(out), "hex_nut_m30-000")
    assert again.returncode == 0, again.stderr
    assert "not tried (refused: no grasp found (best quality 0." in again.stdout
    assert (out / "replay" / "hex_nut_m30-000.png").exists()


class Answers(io.StringIO):
    """Answers typed by an operator."""

    def isatty(self) -> bool:
        return True


@pytest.mark.slow
def test_an_operator_is_asked_before_the_arm_moves_and_may_stop_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    """The simulated cell posing as a real one: n (present again), y, and q before the second trial."""
    monkeypatch.setattr(SapienArm, "simulated", False)
    monkeypatch.setattr(sys, "stdin", Answers("n\ny\nq\n"))
    out = tmp_path / "out"
    with pytest.raises(StoppedByOperator):
        evaluate(config(out, trials=2, seed=1))
    assert list(trials(out)) == ["hex_nut_m30-000"] and (out / "next.png").exists()
    asked = capfd.readouterr().err
    assert asked.count("May the arm move?") == 3 and re.search(r"quality [01]\.\d\d\n", asked)
    monkeypatch.setattr(sys, "stdin", io.StringIO("y\n"))
    with pytest.raises(UsageError, match="has --yes give it"):
        evaluate(config(out, trials=2, seed=1))
    report = evaluate(config(out, trials=2, seed=1, yes=True))
    assert report.summary.overall.trials == 2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(cell=Path("no_cell.yaml")), "no_cell.yaml"),
        (dict(experiment="displacement", compare=("a=typo",)), "no model.json in typo"),
        (dict(experiment="displacement", lowess_data=Path("typo")), "no dataset folder typo"),
    ],
)
def test_a_missing_file_is_reported_before_any_part_is_looked_for(
    changes: dict[str, Any], message: str, tmp_path: Path
):
    with pytest.raises(MskgraspError, match=message):
        evaluate(config(tmp_path / "out", parts=("no_such_part",), **changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(models=Path("typo")), "no model.json in typo"),
        (dict(parts=("hex_nut_m3o",)), "hex_nut_m30"),
        (dict(compare=(f"a={PRETRAINED}",)), "--experiment displacement"),
        (dict(tape=(0.012, 0.008)), "--measure markers"),
        (dict(measure="markers", tape=(0.008, 0.012)), "at least 1.25 times"),
        (dict(cell="real", noise="iid"), "for a simulated cell"),
        (dict(cell="real", workers=2), "one cell; omit --workers"),
        (dict(cell=REPOSITORY / "configs/cells/panda_kinect2.yaml"), r"run hal\.touch"),
        (dict(experiment="displacement", compare=("a-b=x",)), "label=folder"),
        (dict(experiment="displacement", compare=("a",)), "label=folder"),
        (dict(experiment="displacement", compare=(f"LOWESS={PRETRAINED}",)), "is not lowess or certified"),
        (dict(experiment="displacement", compare=("a=typo",)), "no model.json in typo"),
        (dict(experiment="displacement", lowess_data=Path("typo")), "no dataset folder typo"),
        (dict(experiment="displacement", planner=PlannerConfig()), "runs this policy anyway"),
        (
            dict(experiment="displacement", planner=PlannerConfig(policy="quality", check_fingers=True)),
            "omit --planner.check-fingers",
        ),
    ],
)
def test_unusable_settings_are_refused_in_one_line_and_leave_no_folder(
    changes: dict[str, Any], message: str, tmp_path: Path
):
    if changes.get("cell") == "real":
        changes = changes | {"cell": measured_cell(tmp_path)}
    with pytest.raises(MskgraspError, match=message) as raised:
        evaluate(config(tmp_path / "out", **changes))
    assert raised.value.exit_code == 2
    assert "\n" not in str(raised.value) and not (tmp_path / "out").exists()


@pytest.mark.slow  # test_run of the assessment places a bar by certified grasps
def test_certified_grasps_are_made_and_executed_in_the_scenes_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    bar = make_box(tmp_path, "bar", (0.07, 0.024, 0.018), 0.2)
    # A box has three resting poses, and few simulations do for it.
    monkeypatch.setattr(certify_parts, "CertifyConfig", partial(CertifyConfig, simulations=72))
    out = tmp_path / "out"
    planning = PlannerConfig(policy="certified", n_candidates=60)
    report = evaluate(
        config(out, parts=(str(bar.folder),), trials=2, experiment="displacement", planner=planning)
    )
    found, by_model = trials(out), ("-pretrained", "-pretrained-recentred")
    assert set(found) == {f"bar-00{k}{by}" for k in range(2) for by in ("", *by_model, "-certified")}
    own = [found[f"bar-00{k}-certified"] for k in range(2)]
    assert all(one.success and one.policy == "certified" for one in own)
    for one in own:
        depths = [
            read_trial(trial_file(out, key))[0].depth for key in (one.key, one.key[: -len("-certified")])
        ]
        np.testing.assert_array_equal(*depths)
        off = np.subtract(one.predicted, one.measured)
        assert np.linalg.norm(off[:3]) < 1e-3 and abs(off[3]) < 0.02
    rows = report.to_json()["policies"]
    assert rows["certified grasps"]["successes"] == 2
    again = config(out, parts=(str(bar.folder),), trials=2, experiment="displacement", planner=planning)
    assert evaluate(again).to_json()["policies"] == rows  # neither certified nor executed anew
