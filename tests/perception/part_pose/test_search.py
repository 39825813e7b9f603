from dataclasses import replace

import numpy as np
import pytest

import mskgrasp.perception.part_pose.search
from mskgrasp.perception.part_pose.search import CLOSE, FINAL, Fit, _turned, improve, judge, search
from tests.perception.part_pose.cells import kinect2, known, posed, resting_at, seen

NAME = "l_bracket_60x40"


@pytest.fixture(scope="module", params=[False, True])
def image(mujoco_cell, request):
    true = resting_at(NAME, 0, 0.5, 0.02, 0.8)
    frame = posed(mujoco_cell, NAME, true)
    frame = kinect2(frame, seed=2) if request.param else frame
    return seen(mujoco_cell, frame, NAME)


def start(offset: tuple[float, float, float]) -> Fit:
    look = next(look for look in known(NAME).looks if look.poses[0].resting == 0)
    pose = np.array([0.5, 0.02, 0.8]) + offset
    return Fit(look=look, lying=look.poses[0], pose=pose, covariance=np.zeros((3, 3)), cost=0.0)


def test_a_fit_beside_the_truth_is_moved_to_it(image):
    fit = start((1e-3, -0.8e-3, 0.03))
    for _ in range(4):
        fit = improve(fit, image, known(NAME), CLOSE)
    assert np.linalg.norm(fit.pose[:2] - [0.5, 0.02]) < 0.5e-3
    assert abs(fit.pose[2] - 0.8) < np.radians(0.7)


def test_the_truth_costs_less_than_poses_around_it(image):
    true = judge(start((0, 0, 0)), image).cost
    for offset in ((3e-3, 0, 0), (0, -3e-3, 0), (0, 0, 0.1), (0, 0, np.pi)):
        assert judge(start(offset), image).cost > true + 5


def test_the_exact_costs_of_the_truth_are_those_of_noise(image):
    """Half of the squared error over the variance, on average, and the normal distribution's factor."""
    pixel_costs = judge(start((0, 0, 0)), image).pixel_costs
    assert pixel_costs is not None
    least = np.log(image.sigma * np.sqrt(2 * np.pi) / 0.99)
    assert pixel_costs.mean() - least < 0.6


def test_the_last_fit_ends_at_the_truth(image):
    fit = improve(start((0.5e-3, -0.4e-3, 0.01)), image, known(NAME), CLOSE)
    final = improve(fit, image, known(NAME), FINAL)
    assert np.linalg.norm(final.pose[:2] - [0.5, 0.02]) < (0.3e-3 if image.noisy else 0.1e-3)


def test_the_best_fit_comes_first_and_the_search_is_repeatable(image):
    fits = search(image, known(NAME))
    assert [fit.cost for fit in fits] == sorted(fit.cost for fit in fits)
    assert np.array_equal(search(image, known(NAME))[0].pose, fits[0].pose)


def test_fits_far_behind_the_best_are_given_up_without_effect(image, monkeypatch):
    fits = search(image, known(NAME))
    monkeypatch.setattr(mskgrasp.perception.part_pose.search, "HOPELESS", np.inf)
    assert np.array_equal(search(image, known(NAME))[0].pose, fits[0].pose)


def test_a_fit_turned_to_where_the_part_nearly_looks_the_same_is_turned_back(image):
    fit = start((0, 0, -2.0))
    fit = replace(fit, look=replace(fit.look, rivals=(2.0,)))
    best = _turned(fit, image, known(NAME))[0]
    assert abs(best.pose[2] - 0.8) < np.radians(0.7)


def test_of_two_poses_that_explain_an_image_the_more_probable_one_costs_less(image):
    fit = start((0, 0, 0))
    rare = replace(fit, lying=replace(fit.lying, probability=fit.lying.probability / 3))
    assert judge(rare, image).cost - judge(fit, image).cost == pytest.approx(np.log(3), abs=1e-6)
