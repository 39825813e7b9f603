import numpy as np
from hypothesis import given, settings

from mskgrasp.core.displacement_covariance import (
    grasp_displacement_covariance,
    half_turned_covariance,
    half_turned_displacement,
    object_displacement_covariance,
)
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import to_object_displacement
from tests.core.test_grasp import centres, shifts


@given(shifts, centres)
def test_the_covariance_is_that_of_the_derivative(displacement, centre):
    variance = np.array([1e-6, 4e-6, 9e-6, 1e-4])
    covariance = object_displacement_covariance(displacement, variance, centre)
    jacobian = np.zeros((4, 4))
    for k in range(4):
        step = np.zeros(4)
        step[k] = 1e-6
        ahead, behind = (to_object_displacement(displacement + s * step, centre) for s in (1, -1))
        change = ahead - behind
        change[3] = wrap_angle(change[3])
        jacobian[:, k] = change / 2e-6
    assert np.allclose(covariance, jacobian @ np.diag(variance) @ jacobian.T, atol=1e-10)


@settings(max_examples=30)
@given(shifts, centres)
def test_to_first_order_the_covariance_of_any_point_is_that_of_samples(displacement, point):
    std = np.array([0.001, 0.002, 0.0005, 0.02])
    drawn = displacement + std * np.random.default_rng(0).normal(size=(40_000, 4))
    moved = to_object_displacement(drawn, point) - to_object_displacement(displacement, point)
    moved[:, 3] = wrap_angle(moved[:, 3])
    covariance = object_displacement_covariance(displacement, std**2, point)
    scale = np.sqrt(np.diag(covariance))
    # Correlations and variance ratios of 40 000 samples, to some three deviations.
    assert np.abs((np.cov(moved.T) - covariance) / np.outer(scale, scale)).max() < 0.03


def test_a_point_far_from_the_hand_is_less_certain_by_what_the_turn_moves_it():
    variance = np.array([1e-6, 4e-6, 9e-6, 1e-4])
    covariance = object_displacement_covariance(np.zeros(4), variance, np.array([0.05, 0.0, 0.02]))
    np.testing.assert_allclose(np.diag(covariance), variance + [0.0, 0.05**2 * 1e-4, 0.0, 0.0], atol=1e-15)


@given(shifts, centres)
def test_the_covariance_of_the_grasp_displacement_is_got_back_from_that_of_a_point(displacement, centre):
    variance = np.array([1e-6, 4e-6, 9e-6, 1e-4])
    of_point = object_displacement_covariance(displacement, variance, centre)
    covariance = grasp_displacement_covariance(displacement, of_point, centre)
    np.testing.assert_allclose(covariance, np.diag(variance), atol=1e-15)


def test_half_a_turn_reverses_x_and_y_of_samples_and_of_their_covariance():
    drawn = np.random.default_rng(0).normal(size=(50, 4)) @ np.random.default_rng(1).normal(size=(4, 4))
    turned = half_turned_displacement(drawn, -1.0)
    np.testing.assert_array_equal(turned, np.column_stack([-drawn[:, :2], drawn[:, 2:]]))
    np.testing.assert_allclose(half_turned_covariance(np.cov(drawn.T), -1.0), np.cov(turned.T))
    np.testing.assert_array_equal(half_turned_covariance(np.cov(drawn.T), 1.0), np.cov(drawn.T))
