from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.dataset import Attempts
from mskgrasp.dataset.ranges import range_problems
from tests import synthetic


@pytest.fixture(scope="module")
def attempts() -> Attempts:
    return synthetic.random_attempts(12, (0.05, 0.02, 0.03), np.random.default_rng(3))


def _with(attempts: Attempts, name: str, rows: np.ndarray | slice, value: object) -> Attempts:
    array = getattr(attempts, name).copy()
    array[rows] = value
    return dataclasses.replace(attempts, **{name: array})


def _found(attempts: Attempts, **info: object) -> list[str]:
    return list(range_problems(attempts, dataclasses.replace(synthetic.info("box"), **info)))


def test_plausible_attempts_have_no_problem(attempts):
    assert _found(attempts) == []


def test_a_value_that_cannot_be_is_named_with_the_legal_ones(attempts):
    held = np.flatnonzero(attempts.success)
    for name, rows, value, words in (
        ("width_after", held[:1], 0.2, f"attempt {held[0]} is called a success with pads 200.00 mm apart"),
        ("tilt", held[:2], -0.1, "has tilt -0.100 rad, legal 0..pi (2 such attempts)"),
        ("depth", slice(3, 4), 0, "attempt 3 has a depth image without one valid pixel"),
        ("depth", slice(3, 4), 100, "down to 0.010 m"),
        ("depth", slice(3, 4), 60000, "is its unit 0.1 mm?"),
    ):
        assert words in "\n".join(_found(_with(attempts, name, rows, value)))


def test_poses_must_agree_with_each_other(attempts):
    shifted = attempts.pose_base_obj.copy()
    shifted[4, 0] += 1e-3
    (problem,) = _found(dataclasses.replace(attempts, pose_base_obj=shifted))
    assert problem.startswith("attempt 4 has a pose_tcp_obj_before that does not follow")
    assert "(1.00 mm off)" in problem


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("region", (0.5, 0.3, -0.1, 0.1), "must be x_min < x_max"),
        ("seed", -1, "must not be negative"),
        ("part_hash", "", "part_hash is empty"),
    ],
)
def test_a_property_that_cannot_be_is_named(attempts, name, value, words):
    assert any(words in problem for problem in _found(attempts, **{name: value}))
