"""Stored trials found again, described and drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.evaluate.replay_trial import find_trial
from mskgrasp.runtime.run_folder import TRIALS, append_trial
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
