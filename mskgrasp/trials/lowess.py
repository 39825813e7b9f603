"""Kernel regression of displacements over recorded grasps of the same part (paper, section 4.3).

The paper's LOWESS baseline (after Cleveland 1979): grasps are weighted by a Gaussian of their distance. It
needs the part's pose and recorded grasps of the part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.core.geometry import Pose, quat_to_matrix, wrap_angle
from mskgrasp.core.grasp import pose_base_grasp

BANDWIDTHS_M = (0.001, 0.002, 0.003, 0.005, 0.008, 0.012, 0.02)
"""Candidate kernel widths, metres; `Lowess.fit` selects one by leave-one-out error."""

TURN_LENGTH = 0.03
"""Distance equivalent to a turn of one radian, metres: half the length of a typical part of 6 cm."""

_LEAST_WEIGHT = 1e-300


@dataclass(frozen=True)
class Lowess:
    """Successful grasps of one part, and the kernel width.

    Attributes:
        grasps_obj: (n, 9) grasp point, approach and closing direction in the part's frame, metres (directions
            times ``TURN_LENGTH``).
        displacement_obj: (n, 4) grasp displacement in the part's frame, metres and radians.
        bandwidth: Kernel width, metres.
    """

    grasps_obj: np.ndarray
    displacement_obj: np.ndarray
    bandwidth: float

    @classmethod
    def fit(cls, pose_base_obj: Pose, grasps: np.ndarray, grasp_displacement: np.ndarray) -> Lowess:
        """Fit to successful grasps of one part.

        Args:
            pose_base_obj: (n,) poses of the part at rest.
            grasps: (n, 4) x y z theta in the base frame, as a dataset stores them, metres and radians.
            grasp_displacement: (n, 4) axes of the grasp frame, metres and radians.

        Raises:
            ValueError: Fewer than two grasps.
        """
        if len(grasps) < 2:
            raise ValueError("at least two successful grasps of the part are needed")
        displacement = np.array(grasp_displacement, dtype=np.float64)
        displacement[:, :3] = np.einsum("nij,nj->ni", _grasp_axes(pose_base_obj, grasps), displacement[:, :3])
        features = _grasps_obj(pose_base_obj, grasps)
        squared = _squared_distances(features, features)
        np.fill_diagonal(squared, np.inf)
        losses = [_loss(_weighted(squared, displacement, width)[0], displacement) for width in BANDWIDTHS_M]
        return cls(features, displacement, BANDWIDTHS_M[int(np.argmin(losses))])

    def predict(self, pose_base_obj: Pose, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predict mean and variance (n, 4) of grasp displacements, grasp frame's axes, of grasps (n, 4)."""
        squared = _squared_distances(_grasps_obj(pose_base_obj, grasps), self.grasps_obj)
        mean, covariance = _weighted(squared, self.displacement_obj, self.bandwidth)
        rotation = np.zeros((len(grasps), 4, 4))
        rotation[:, :3, :3] = np.swapaxes(_grasp_axes(pose_base_obj, grasps), -1, -2)
        rotation[:, 3, 3] = 1.0
        variance = np.einsum("nij,njk,nik->ni", rotation, covariance, rotation)
        return np.einsum("nij,nj->ni", rotation, mean), variance


def _grasp_axes(pose_base_obj: Pose, grasps: np.ndarray) -> np.ndarray:
    """Axes (n, 3, 3) of the grasp frames in the part's frame."""
    part = quat_to_matrix(np.asarray(pose_base_obj.quat_wxyz, dtype=np.float64))
    hand = quat_to_matrix(np.asarray(pose_base_grasp(grasps.astype(np.float64)).quat_wxyz))
    return np.swapaxes(part, -1, -2) @ hand


def _grasps_obj(pose_base_obj: Pose, grasps: np.ndarray) -> np.ndarray:
    """Features (n, 9) of grasps in the part's frame."""
    axes = _grasp_axes(pose_base_obj, grasps)
    part = quat_to_matrix(np.asarray(pose_base_obj.quat_wxyz, dtype=np.float64))
    point = np.einsum("nji,nj->ni", part, grasps[:, :3] - np.asarray(pose_base_obj.position))
    return np.concatenate([point, TURN_LENGTH * axes[:, :, 2], TURN_LENGTH * axes[:, :, 1]], axis=1)


def _squared_distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Squared distances (n, m); a closing direction equals its reverse."""
    difference = ((one[:, None, :6] - other[None, :, :6]) ** 2).sum(axis=-1)
    same, reversed_ = (
        ((one[:, None, 6:] - sign * other[None, :, 6:]) ** 2).sum(axis=-1) for sign in (1.0, -1.0)
    )
    return difference + np.minimum(same, reversed_)


def _weighted(squared: np.ndarray, displacement: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Weighted mean (n, 4) and covariance (n, 4, 4) of the neighbours' displacements."""
    # Relative to the nearest grasp: far from all grasps the weights would underflow.
    exponent = -(squared - squared.min(axis=1, keepdims=True)) / (2 * width**2)
    weights = np.maximum(np.exp(exponent), _LEAST_WEIGHT)
    weights = np.where(np.isfinite(squared), weights, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    # Circular mean: angles may wrap at half a turn.
    mean, angle = weights @ displacement, displacement[:, 3]
    mean[:, 3] = np.arctan2(weights @ np.sin(angle), weights @ np.cos(angle))
    deviation = displacement[None] - mean[:, None]
    deviation[..., 3] = wrap_angle(deviation[..., 3])
    return mean, np.einsum("nm,nmi,nmj->nij", weights, deviation, deviation)


def _loss(mean: np.ndarray, displacement: np.ndarray) -> float:
    error = displacement - mean
    error[:, 3] = TURN_LENGTH * wrap_angle(error[:, 3])
    return float((error**2).sum(axis=1).mean())
