"""Stored trials found again, described and drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.evaluate.replay_trial import describe_trial, find_trial, outcome_text
from mskgrasp.runtime.run_folder import TRIALS, append_trial
from mskgrasp.trials.trial import Prediction
from tests.evaluate.made_trials import trial


def test_a_part_name_with_a_path_is_refused(tmp_path: Path):
    append_trial(tmp_path / TRIALS, trial().to_json() | {"part": "../../etc/passwd"})
    with pytest.raises(BadDataset, match="not a trial"):
        find_trial(tmp_path, "../../etc/passwd-000")


def test_an_unknown_run_or_trial_is_refused_with_the_known_ones(tmp_path: Path):
    with pytest.raises(UsageError, match="no run of mskgrasp.evaluate"):
        find_trial(tmp_path, "a-000")
    append_trial(tmp_path / TRIALS, trial().to_json())
    with pytest.raises(UsageError, match="no trial 'a-001' .* for example a-000"):
        find_trial(tmp_path, "a-001")


def test_an_outcome_is_described_in_one_line():
    assert outcome_text(trial(success=False, reason="slipped")) == "not lifted (slipped)"
    unmeasured = trial(measured=None, unmeasured="one found: the larger square is seen")
    assert outcome_text(unmeasured) == "lifted, not measured (one found)"
    # Predicted 3 mm along x, moved 4 mm along y: 5 mm apart.
    assert outcome_text(trial()) == (
        "lifted, moved dx +0.0, dy +4.0, dz +0.0 mm, turn -5.7 deg; prediction off by 5.0 mm and 11.5 deg"
    )
    planar = trial(measured=[0.001, 0.0, np.nan, 0.0], predicted=None)
    assert outcome_text(planar) == "lifted, moved dx +1.0, dy +0.0 mm, turn +0.0 deg"


def test_a_trial_is_described_with_every_prediction_and_the_truth():
    one = trial(
        predictions={"lowess": Prediction(mean=[0.0, 0.001, 0.0, 0.0], std=[np.nan] * 4)},
        measured=[0.0, 0.004, np.nan, -0.1], true=[0.0, 0.0043, 0.001, -0.1], chosen_by="net",
    )  # fmt: skip
    lines = describe_trial(one).splitlines()
    assert lines[0] == "a-000-net  (nut; chosen by quality; seed 1)"
    assert lines[1].startswith("outcome    lifted, moved dx +0.0, dy +4.0 mm")
    assert (
        lines[2] == "planner    dx +3.0 +- 1.0 mm, dy +0.0 +- 1.0 mm, dz +0.0 +- 1.0 mm, turn +5.7 +- 0.1 deg"
    )
    assert lines[3] == "lowess     dx +0.0 mm, dy +1.0 mm, dz +0.0 mm, turn +0.0 deg"
    assert lines[4] == "measured   dx +0.0 mm, dy +4.0 mm, dz - mm, turn -5.7 deg"
    assert lines[5] == "true       dx +0.0 mm, dy +4.3 mm, dz +1.0 mm, turn -5.7 deg"
