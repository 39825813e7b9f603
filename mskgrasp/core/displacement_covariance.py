"""Spread of a part's points, from the mean and the variances of grasp displacement and swing."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import wrap_angle


def object_displacement_covariance(
    grasp_displacement: np.ndarray, variance: np.ndarray, centre_grasp: np.ndarray
) -> np.ndarray:
    """Compute the covariance of a point's displacement, to first order in the grasp displacement's.

    Args:
        grasp_displacement: (..., 4) mean.
        variance: (..., 4) of independent components.
        centre_grasp: (..., 3) the point in the grasp frame before the grasp, metres.

    Returns:
        (..., 4, 4) J diag(variance) J', J of `displacement_jacobian`.
    """
    jacobian = displacement_jacobian(grasp_displacement, centre_grasp)
    return jacobian * variance[..., None, :] @ np.swapaxes(jacobian, -1, -2)


def grasp_displacement_covariance(
    grasp_displacement: np.ndarray, covariance: np.ndarray, centre_grasp: np.ndarray
) -> np.ndarray:
    """Compute the covariance (4, 4) of a grasp displacement (4,) from that of a point's displacement.

    The inverse of `object_displacement_covariance`, to first order.

    Args:
        grasp_displacement: (4,) mean.
        covariance: (4, 4) of the point's displacement.
        centre_grasp: (3,) the point in the grasp frame before the grasp, metres.
    """
    inverse = np.linalg.inv(displacement_jacobian(grasp_displacement, centre_grasp))
    return inverse @ covariance @ inverse.T


def half_turned_displacement(displacement: np.ndarray, sign: float) -> np.ndarray:
    """A displacement (..., 4) in the axes of a grasp turned by half a turn (sign -1), or not (1)."""
    return displacement * np.array([sign, sign, 1.0, 1.0])


def half_turned_covariance(covariance: np.ndarray, sign: float) -> np.ndarray:
    """Its covariance (4, 4)."""
    signs = np.array([sign, sign, 1.0, 1.0])
    return covariance * signs * signs[:, None]


def displacement_jacobian(grasp_displacement: np.ndarray, centre_grasp: np.ndarray) -> np.ndarray:
    """Derivative (..., 4, 4) of `grasp.to_object_displacement` by the grasp displacement (..., 4).

    Args:
        grasp_displacement: (..., 4) metres and radians.
        centre_grasp: (..., 3) the point in the grasp frame before the grasp, metres.
    """
    turn = -wrap_angle(grasp_displacement[..., 3])
    cos, sin = np.cos(turn), np.sin(turn)
    arm = centre_grasp - grasp_displacement[..., :3]
    jacobian = np.zeros(grasp_displacement.shape[:-1] + (4, 4))
    jacobian[..., 0, 0], jacobian[..., 0, 1] = -cos, sin
    jacobian[..., 1, 0], jacobian[..., 1, 1] = -sin, -cos
    jacobian[..., 2, 2] = -1.0
    jacobian[..., 0, 3] = sin * arm[..., 0] + cos * arm[..., 1]
    jacobian[..., 1, 3] = -cos * arm[..., 0] + sin * arm[..., 1]
    jacobian[..., 3, 3] = -1.0
    return jacobian


def swing_squared(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Expected squared swing (...), radians squared, of predictions (..., k): 0 where k = 4, without swing.

    The mean counts, too: a tilted part cannot be placed flat.
    """
    return (mean[..., 4:] ** 2 + variance[..., 4:]).sum(axis=-1)
