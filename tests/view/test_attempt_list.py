"""Attempts at one part, and their filter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import quat_about_z, quat_multiply
from mskgrasp.dataset import open_dataset, read_shard, u16_to_depth
from mskgrasp.parts import find_part
from mskgrasp.view.attempt_list import ALL, LIFTED, AttemptList, resting_poses
from tests.collecting import PARTS


@pytest.fixture(scope="module")
def attempts(collected: Path) -> AttemptList:
    return AttemptList.of(open_dataset(collected), PARTS[0])


def test_the_attempts_at_a_part_are_those_of_its_shards_in_order(collected: Path, attempts: AttemptList):
    shards = [read_shard(path) for path in open_dataset(collected).paths if PARTS[0] in path.name]
    assert len(shards) == 2 and len(attempts) == sum(len(rows) for rows, _ in shards)
    np.testing.assert_array_equal(
        attempts.columns["grasp"], np.concatenate([rows.grasp for rows, _ in shards])
    )
    last = len(attempts) - 1
    rows, info = shards[1]
    np.testing.assert_array_equal(attempts.depth(last), u16_to_depth(rows.depth[-1]))
    assert attempts.info(last).index == info.index


def test_a_part_without_attempts_is_refused(collected: Path):
    with pytest.raises(UsageError, match=f"no attempts at part 'none'.*{min(PARTS)}"):
        AttemptList.of(open_dataset(collected), "none")


def test_every_attempt_has_one_of_the_outcomes(attempts: AttemptList):
    outcomes = attempts.outcomes()
    assert outcomes[:2] == [ALL, LIFTED]
    found = np.concatenate([attempts.chosen(one) for one in outcomes[1:]])
    np.testing.assert_array_equal(np.sort(found), np.arange(len(attempts)))
    np.testing.assert_array_equal(attempts.chosen(LIFTED), np.flatnonzero(attempts.columns["success"]))


def test_the_shift_selects_among_lifted_parts_alone(attempts: AttemptList):
    success = attempts.columns["success"]
    moved = np.linalg.norm(attempts.columns["displacement"][success, :3], axis=1)
    middle = float(np.median(moved))
    assert len(attempts.chosen(LIFTED, shift=(middle, np.inf))) == (moved >= middle).sum()
    assert len(attempts.chosen(shift=(1.0, 2.0))) == (~success).sum()


def test_the_resting_pose_selects(attempts: AttemptList):
    resting = np.arange(len(attempts)) % 2
    np.testing.assert_array_equal(attempts.chosen(resting=resting, which=1), np.flatnonzero(resting))


def test_a_resting_pose_is_recognised_at_any_turn():
    part = find_part(PARTS[0])
    numbers = np.arange(len(part.resting_probability))
    for turn in (-2.0, 0.0, 1.0):
        turned = quat_multiply(
            np.broadcast_to(quat_about_z(np.asarray(turn)), part.resting.quat_wxyz.shape),
            part.resting.quat_wxyz,
        )
        np.testing.assert_array_equal(resting_poses(turned, part), numbers)
