"""Drawn poses of a part: at rest, inside the region, and spread over all that is allowed."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose
from mskgrasp.parts.resting_pose import random_resting_pose

REGION = (0.38, 0.62, -0.12, 0.12)
SIZE = np.array([0.08, 0.03, 0.02])
CORNERS = np.array(np.meshgrid(*([-edge / 2, edge / 2] for edge in SIZE))).reshape(3, 8).T
HALF = np.sqrt(0.5)
# Lying flat, standing on an end, and on the edge of falling out of the catalogue.
RESTING = Pose(
    position=np.array([[0, 0, 0.01], [0, 0, 0.04], [0, 0, 0.015]]),
    quat_wxyz=np.array([[1.0, 0, 0, 0], [HALF, 0, HALF, 0], [HALF, HALF, 0, 0]]),
)
PROBABILITY = np.array([0.7, 0.3, 0.0])


def drawn(n: int, region: tuple[float, float, float, float] = REGION, seed: int = 0) -> np.ndarray:
    rng = np.random.RandomState(seed)
    return np.stack([random_resting_pose(RESTING, PROBABILITY, CORNERS, region, rng) for _ in range(n)])


def test_every_part_lies_on_the_table_and_wholly_inside_the_region():
    for vector in drawn(300):
        points = Pose.from_vector(vector).apply(CORNERS)
        assert points[:, 2].min() == pytest.approx(0, abs=1e-12)
        assert (points[:, 0] >= REGION[0] - 1e-12).all() and (points[:, 0] <= REGION[1] + 1e-12).all()
        assert (points[:, 1] >= REGION[2] - 1e-12).all() and (points[:, 1] <= REGION[3] + 1e-12).all()


def test_resting_poses_come_as_often_as_they_are_probable_and_turns_are_uniform():
    found = drawn(2000, seed=1)
    standing = np.isclose(found[:, 2], 0.04)
    assert (np.isclose(found[:, 2], 0.01) | standing).all()  # the third has no probability
    assert standing.mean() == pytest.approx(0.3, abs=4 * np.sqrt(0.3 * 0.7 / 2000))
    ends = Pose.from_vector(found[~standing]).apply(np.array([0.04, 0.0, 0.0])) - found[~standing][:, :3]
    direction = np.arctan2(ends[:, 1], ends[:, 0])
    # Mean resultant of uniform directions: 1 / sqrt(n) in expectation; four times that is one in 10^7.
    assert abs(np.exp(1j * direction).mean()) < 4 / np.sqrt(len(direction))


def test_places_reach_all_sides_of_the_region():
    points = np.concatenate([Pose.from_vector(vector).apply(CORNERS)[:, :2] for vector in drawn(300)])
    np.testing.assert_allclose(points.min(axis=0), [REGION[0], REGION[2]], atol=2e-3)
    np.testing.assert_allclose(points.max(axis=0), [REGION[1], REGION[3]], atol=2e-3)


def test_a_part_larger_than_the_region_lies_in_its_middle():
    for vector in drawn(20, region=(0.49, 0.51, -0.11, -0.09)):
        points = Pose.from_vector(vector).apply(CORNERS)[:, :2]
        np.testing.assert_allclose((points.min(axis=0) + points.max(axis=0)) / 2, [0.5, -0.1], atol=1e-12)


def test_a_seed_determines_the_pose():
    np.testing.assert_array_equal(drawn(5, seed=3), drawn(5, seed=3))
    assert not np.allclose(drawn(5, seed=3), drawn(5, seed=4))
