"""Trials of stored runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.palletize.placement_records import Placement
from mskgrasp.runtime.run_folder import TRIALS, append_trial
from mskgrasp.trials.trial_files import trial_file, write_trial
from mskgrasp.view.stored_run import read_run
from tests.evaluate.made_trials import NOTHING, trial
from tests.planning.hand_made import FRAME

PLACEMENT = Placement(
    part="a", number=2, slot=0, correction="predicted", target=(0.5, 0.06, 1.5), placed=True, reason="",
    grasp=[0.45, 0.0, 0.02, 0.3], predicted=[0.001, 0.0, 0.0, 0.0], measured=None, translation_error=0.0012,
)  # fmt: skip


def test_a_run_of_evaluate_holds_frames_poses_and_displacements(tmp_path: Path):
    lifted = trial(pose_base_obj=[0.5, 0.0, 0.01, 1, 0, 0, 0], measured=[0.001, 0.0, np.nan, 0.1])
    refused = trial(number=1, **NOTHING | {"reason": "refused"}, refusal="too dark")
    for one in (lifted, refused):
        append_trial(tmp_path / TRIALS, one.to_json())
    write_trial(trial_file(tmp_path, lifted.key), FRAME, None, None)
    first, second = read_run(tmp_path)
    assert (first.name, first.outcome, first.file) == ("a-000", "lifted", trial_file(tmp_path, "a-000"))
    assert first.T_base_obj is not None and first.T_base_obj.position[2] == 0.01
    np.testing.assert_array_equal(first.measured, [0.001, 0.0, np.nan, 0.1])
    assert second.outcome == "not lifted (refused): too dark" and second.file is None is second.grasp


@pytest.mark.parametrize("damage", [{"grasp": ["a"] * 4}, {"pose_base_obj": [0.5, 0.0, 0.01]}])
def test_a_damaged_trial_is_an_error_of_one_line(tmp_path: Path, damage: dict[str, list]):
    append_trial(tmp_path / TRIALS, trial().to_json() | damage)
    with pytest.raises(BadDataset, match=r"trials.jsonl.*line 1"):
        read_run(tmp_path)


def test_a_run_of_palletize_holds_targets_and_pictures(tmp_path: Path):
    failed = replace(PLACEMENT, slot=1, placed=False, reason="slipped", translation_error=None)
    for one in (PLACEMENT, failed):
        append_trial(tmp_path / TRIALS, one.to_json())
    (tmp_path / "placements").mkdir()
    path = tmp_path / "placements" / f"{PLACEMENT.name}.png"
    cv2.imwrite(str(path), np.zeros((4, 4, 3), np.uint8))
    first, second = read_run(tmp_path)
    assert first.name == PLACEMENT.name and first.picture == path and second.picture is None
    assert first.outcome == "placed, 1.2 mm from the target; correction: predicted"
    assert second.outcome == "not placed (slipped); correction: predicted"
    np.testing.assert_array_equal(first.target, PLACEMENT.target)


@pytest.mark.parametrize("damage", [{"target": [0.5, 0.06]}, {"predicted": [0.1]}, {"grasp": [1, 2, 3]}])
def test_a_damaged_placement_is_an_error_of_one_line(tmp_path: Path, damage: dict[str, list]):
    append_trial(tmp_path / TRIALS, PLACEMENT.to_json() | damage)
    with pytest.raises(BadDataset, match=r"trials.jsonl.*line 1"):
        read_run(tmp_path)


def test_what_is_no_run_of_these_programs_is_refused(tmp_path: Path):
    with pytest.raises(UsageError, match="no run of evaluate or palletize"):
        read_run(tmp_path)
    (tmp_path / TRIALS).touch()
    with pytest.raises(UsageError, match="no trial yet"):
        read_run(tmp_path)
    append_trial(tmp_path / TRIALS, {"grasp": 1})
    with pytest.raises(UsageError, match="of another program"):
        read_run(tmp_path)
    (tmp_path / TRIALS).write_text("not json\n")
    with pytest.raises(BadDataset, match="line 1 is not a trial"):
        read_run(tmp_path)


def test_a_run_that_is_being_made_is_read_and_nothing_in_it_is_changed(tmp_path: Path):
    path = tmp_path / TRIALS
    append_trial(path, trial().to_json())
    with path.open("ab") as file:
        file.write(b'{"part": "hex_')  # the next trial, half written
    before = path.read_bytes()
    assert len(read_run(tmp_path)) == 1
    assert path.read_bytes() == before
