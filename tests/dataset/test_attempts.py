from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset
from mskgrasp.dataset import Attempts, depth_to_u16, u16_to_depth
from mskgrasp.dataset.attempts import COLUMNS, problems, shape_problems
from tests import synthetic


@pytest.fixture(scope="module")
def attempts() -> Attempts:
    return synthetic.random_attempts(12, (0.05, 0.02, 0.03), np.random.default_rng(3))


def test_depth_survives_storage_to_half_a_step_and_invalid_stays_invalid():
    depth = np.array([[0.8, 0.123456, np.nan, 6.5535]], np.float32)
    again = u16_to_depth(depth_to_u16(depth))
    assert np.isnan(again[0, 2])
    assert np.nanmax(np.abs(again - depth)) <= 0.5e-4 + 1e-6


@pytest.mark.parametrize("depth", [800.0, -0.1])
def test_a_depth_that_cannot_be_metres_is_refused(depth):
    with pytest.raises(BadDataset, match=r"outside 0..6.5535"):
        depth_to_u16(np.array([depth]))


def test_attempts_join_in_order(attempts):
    joined = Attempts.concatenate([attempts, attempts])
    assert len(joined) == 24 and np.array_equal(joined.grasp[12:], attempts.grasp)
    smaller = dataclasses.replace(attempts, depth=attempts.depth[:, :80])
    with pytest.raises(BadDataset, match="different sizes"):
        Attempts.concatenate([attempts, smaller])
    with pytest.raises(BadDataset, match="no attempts"):
        Attempts.concatenate([])


def test_a_wrong_type_and_a_wrong_shape_are_named(attempts):
    arrays = {name: getattr(attempts, name) for name in COLUMNS}
    assert list(shape_problems(arrays)) == []
    (problem,) = shape_problems(arrays | {"tilt": attempts.tilt.astype(np.float64)})
    assert problem == "tilt is float64, must be float32"
    (problem,) = shape_problems(arrays | {"grasp": attempts.grasp[:-1]})
    assert problem == "grasp has shape (11, 4), must be (12, 4)"


def test_a_wrong_shape_hides_no_defect_behind_an_exception(attempts):
    assert list(problems(attempts)) == []
    (problem,) = problems(dataclasses.replace(attempts, failure=attempts.failure[:5]))
    assert problem.startswith("failure has shape (5,)")
