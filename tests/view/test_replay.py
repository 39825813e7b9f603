"""Stored attempts, simulated again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.geometry import pose_distance
from mskgrasp.core.grasp import FAILURES, pose_base_tcp
from mskgrasp.core.panda_kinematics import forward_pose
from mskgrasp.dataset import open_dataset
from mskgrasp.parts import find_part
from mskgrasp.view.attempt_list import AttemptList
from mskgrasp.view.replay import AttemptSimulator
from tests.collecting import PARTS


@pytest.fixture(scope="module")
def simulator() -> Iterator[AttemptSimulator]:
    one = AttemptSimulator()
    yield one
    one.close()


@pytest.fixture(scope="module")
def attempts(collected: Path) -> AttemptList:
    return AttemptList.of(open_dataset(collected), PARTS[1])


def rows_of(attempts: AttemptList, number: int) -> dict[str, np.ndarray]:
    return {name: values[number] for name, values in attempts.columns.items()}


def test_an_attempt_ends_as_it_did_and_its_motion_ends_in_the_lifted_hand(
    simulator: AttemptSimulator, attempts: AttemptList
):
    part, success = find_part(PARTS[1]), attempts.columns["success"]
    for number in (int(np.flatnonzero(success)[0]), int(np.flatnonzero(~success)[0])):
        row = rows_of(attempts, number)
        replay = simulator.simulate(part, attempts.info(number), row)
        assert replay.failure == FAILURES[int(row["failure"])]
        np.testing.assert_allclose(replay.displacement, row["displacement"], atol=1e-5)
        motion = replay.motion
        assert motion.seconds[0] == 0 and np.diff(motion.seconds).min() > 0
        assert (
            len(motion.joints) == len(motion.width) == len(motion.T_base_obj.position) == len(motion.seconds)
        )
        if row["success"]:
            raised = row["grasp"] + [0, 0, attempts.info(number).physics["lift_height"], 0]
            hand = forward_pose(motion.joints[-1])
            assert pose_distance(hand, pose_base_tcp(raised.astype(float)))[0] < 2e-3
            assert motion.width[-1] < motion.width[0]


def test_an_attempt_of_unknown_number_is_simulated_at_the_stored_pose(
    simulator: AttemptSimulator, attempts: AttemptList
):
    number = int(np.flatnonzero(attempts.columns["success"])[0])
    row = rows_of(attempts, number) | {"attempt": np.array(-1), "draw": np.array(-1)}
    replay = simulator.simulate(find_part(PARTS[1]), attempts.info(number), row)
    first = replay.motion.T_base_obj.position[0]
    np.testing.assert_allclose(first[:2], row["pose_base_obj"][:2], atol=2e-3)
    assert replay.failure == "none"


def test_a_shard_of_other_settings_is_simulated_with_them(simulator: AttemptSimulator, attempts: AttemptList):
    number = int(np.flatnonzero(attempts.columns["success"])[0])
    info = attempts.info(number)
    slippery = replace(info, physics=info.physics | {"friction_pad_part": 0.02})
    replay = simulator.simulate(find_part(PARTS[1]), slippery, rows_of(attempts, number))
    assert replay.failure != "none"
