"""Files of trials: frames and plans are read back equal, damaged files are refused."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from hal.camera import RgbdFrame
from mskgrasp.core.errors import BadDataset
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.evaluate.replay_trial import draw_trial, find_trial
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.planner import Planner
from mskgrasp.runtime.run_folder import TRIALS, append_trial, read_trials, resume_trials
from mskgrasp.trials.trial import Prediction, Trial
from mskgrasp.trials.trial_files import read_trial, trial_file, write_trial
from tests import synthetic
from tests.evaluate.made_trials import trial
from tests.figures import picture


def captured() -> RgbdFrame:
    """A box on the table, with a hole in the image."""
    box = synthetic.Box(x=0.5, y=0.01, yaw=0.4, size=(0.06, 0.03, 0.03))
    frame = synthetic.frame([box])
    depth = np.round(frame.depth.astype(np.float64), 4).astype(np.float32)
    depth[:3, :3] = np.nan
    fine = np.full((2 * depth.shape[0], 2 * depth.shape[1], 3), 7, np.uint8)
    return dataclasses.replace(frame, depth=depth, fine_colour=fine)


def stored(run: Path, one: Trial) -> tuple[RgbdFrame, GraspPlan]:
    planner = Planner(
        load_models(PRETRAINED),
        PlannerConfig(n_candidates=50),
        table_z=synthetic.TABLE_Z,
        region=synthetic.REGION,
    )
    frame = captured()
    plan = planner.plan(frame, np.random.default_rng(0))
    view = dataclasses.replace(plan.view, table_offset=-0.002)
    plan = dataclasses.replace(plan, view=view, planned_by="uncertified")
    write_trial(trial_file(run, one.key), frame, plan, None)
    append_trial(run / TRIALS, one.to_json())
    return frame, plan


def test_a_trial_is_read_back_equal_and_drawn(tmp_path: Path):
    one = trial(predictions={"m": Prediction(mean=[0.0] * 4, std=[np.nan] * 4)}, chosen_by="gcip_mv")
    frame, plan = stored(tmp_path, one)
    assert one.key == "a-000-gcip_mv"
    again, planned, after = read_trial(trial_file(tmp_path, one.key))
    np.testing.assert_allclose(again.depth, frame.depth, atol=1e-6)
    np.testing.assert_array_equal(again.T_base_camera.position, frame.T_base_camera.position)
    assert after is None and again.fine_colour is None  # stored only with a frame after the grasp
    assert planned is not None and planned.planned_by == "uncertified" and not planned.certified
    for field in dataclasses.fields(planned):
        if isinstance(value := getattr(plan, field.name), np.ndarray):
            np.testing.assert_allclose(getattr(planned, field.name), value, rtol=1e-6, err_msg=field.name)
    np.testing.assert_array_equal(planned.grasp.as_vector(), plan.grasp.as_vector())
    np.testing.assert_allclose(planned.candidates.as_vector(), plan.candidates.as_vector(), rtol=1e-6)
    for name in ("centre_base", "size", "gyration_radius", "table_z", "table_offset"):
        np.testing.assert_allclose(getattr(planned.view, name), getattr(plan.view, name), err_msg=name)
    draw_trial(tmp_path, find_trial(tmp_path, one.key), tmp_path / "replay" / "one.png")
    assert (tmp_path / "replay" / "one.png").stat().st_size > 10_000


def test_a_trial_without_a_plan_is_drawn_as_its_frame(tmp_path: Path):
    one = trial(success=False, reason="no part found", grasp=None, predicted=None, measured=None)
    write_trial(trial_file(tmp_path, one.key), captured(), None, captured())
    frame, plan, after = read_trial(trial_file(tmp_path, one.key))
    assert plan is None and after is not None and after.fine_colour is not None
    assert frame.fine_colour is not None
    draw_trial(tmp_path, one, tmp_path / "one.png")
    write_trial(trial_file(tmp_path, one.key), synthetic.frame([]), None, None)
    draw_trial(tmp_path, one, tmp_path / "empty.png")
    box, empty = (picture(tmp_path / name) for name in ("one.png", "empty.png"))
    assert box.shape == empty.shape and not np.array_equal(box, empty)


def test_trials_are_read_back_equal_and_an_incomplete_last_line_is_removed(tmp_path: Path):
    path = tmp_path / "trials.jsonl"
    first = trial(predicted_std=[np.nan] * 4, measured=[0.1, 0.2, np.nan, 0.3])
    lines = [json.dumps(one.to_json(), allow_nan=False) for one in (first, trial(number=1))]
    path.write_text(lines[0] + "\n" + lines[1][:40])
    (found,) = resume_trials(path, Trial.from_json)
    assert found.key == "a-000" and np.isnan(found.predicted_std).all()
    np.testing.assert_array_equal(found.measured, first.measured)
    assert path.read_text() == lines[0] + "\n"
    old = {name: value for name, value in first.to_json().items() if name != "point_base"}
    for text in ("no json", json.dumps(old)):  # it predicted one point and measured another
        path.write_text(text + "\n")
        with pytest.raises(BadDataset, match="line 1 is not a trial"):
            read_trials(path, Trial.from_json)


@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 cut short", b"\x80\x04N."], ids=["empty", "zip", "pickle"]
)
def test_a_damaged_file_is_an_error_of_one_line(tmp_path: Path, content: bytes):
    path = trial_file(tmp_path, "a-000")
    with pytest.raises(BadDataset, match="no .*a-000.npz"):
        read_trial(path)
    path.parent.mkdir()
    path.write_bytes(content)
    with pytest.raises(BadDataset, match="a-000.npz is damaged") as raised:
        read_trial(path)
    assert "\n" not in str(raised.value)


def test_a_schema_version_that_is_infinite_is_an_error_of_one_line(tmp_path: Path):
    path = tmp_path / "a-000.npz"
    np.savez(path, schema_version=np.inf)
    with pytest.raises(BadDataset, match="a-000.npz is damaged"):
        read_trial(path)
