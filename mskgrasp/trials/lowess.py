"""Displacements of known parts, from the grasps of the same part that were most alike (paper, section 4.3).

Kernel regression as the paper describes its LOWESS (after Cleveland 1979): neighbours weighted by a Gaussian
of their distance. It needs the part's pose and grasps of this very part, so it serves as a baseline alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mskgrasp.core.geometry import Pose, quat_to_matrix, wrap_angle
from mskgrasp.core.grasp import pose_base_grasp

BANDWIDTHS_M = (0.001, 0.002, 0.003, 0.005, 0.008, 0.012, 0.02)
"""Candidates for the kernel's width, metres; the one that predicts left-out grasps best is taken."""

TURN_LENGTH = 0.03
"""Metres that a turn of one radian counts as: points of a part of 6 cm move so far."""

_LEAST_WEIGHT = 1e-300


@dataclass(frozen=True)
class Lowess:
    """The successful grasps of one part, and the kernel's width.

    Attributes:
        where: (n, 9) grasp point, approach and closing direction in the part's frame, metres (directions
            times ``TURN_LENGTH``).
        moved: (n, 4) how the hand moved in the part's frame, metres and radians.
        bandwidth: Metres.
    """

    where: np.ndarray
    moved: np.ndarray
    bandwidth: float

    @classmethod
    def fit(cls, pose_base_obj: Pose, grasps: np.ndarray, grasp_displacement: np.ndarray) -> Lowess:
        """From grasps of one part that lifted it.

        Args:
            pose_base_obj: n poses at rest.
            grasps: (n, 4) base frame.
            grasp_displacement: (n, 4), axes of the grasp frame.

        Raises:
            ValueError: There are fewer than two.
        """
        if len(grasps) < 2:
            raise ValueError("at least two successful grasps of the part are needed")
        turn = _grasp_axes(pose_base_obj, grasps)
        moved = np.array(grasp_displacement, dtype=np.float64)
        moved[:, :3] = np.einsum("nij,nj->ni", turn, moved[:, :3])
        where = _where(pose_base_obj, grasps)
        squared = _squared_distances(where, where)
        np.fill_diagonal(squared, np.inf)
        errors = [_loss(_weighted(squared, moved, width)[0], moved) for width in BANDWIDTHS_M]
        return cls(where, moved, BANDWIDTHS_M[int(np.argmin(errors))])

    def predict(self, pose_base_obj: Pose, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance (n, 4) of the grasp displacement of grasps (n, 4), axes of the grasp frame."""
        squared = _squared_distances(_where(pose_base_obj, grasps), self.where)
        mean, covariance = _weighted(squared, self.moved, self.bandwidth)
        back = np.swapaxes(_grasp_axes(pose_base_obj, grasps), -1, -2)
        turned = np.zeros((len(grasps), 4, 4))
        turned[:, :3, :3], turned[:, 3, 3] = back, 1.0
        variance = np.einsum("nij,njk,nik->ni", turned, covariance, turned)
        return np.einsum("nij,nj->ni", turned, mean), variance


def _grasp_axes(pose_base_obj: Pose, grasps: np.ndarray) -> np.ndarray:
    """(n, 3, 3) axes of the grasp frame in the part's."""
    part = quat_to_matrix(np.asarray(pose_base_obj.quat_wxyz, dtype=np.float64))
    hand = quat_to_matrix(np.asarray(pose_base_grasp(grasps.astype(np.float64)).quat_wxyz))
    return np.swapaxes(part, -1, -2) @ hand


def _where(pose_base_obj: Pose, grasps: np.ndarray) -> np.ndarray:
    axes = _grasp_axes(pose_base_obj, grasps)
    part = quat_to_matrix(np.asarray(pose_base_obj.quat_wxyz, dtype=np.float64))
    point = np.einsum("nji,nj->ni", part, grasps[:, :3] - np.asarray(pose_base_obj.position))
    return np.concatenate([point, TURN_LENGTH * axes[:, :, 2], TURN_LENGTH * axes[:, :, 1]], axis=1)


def _squared_distances(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n, m); the jaw is the same after half a turn, which reverses its closing direction."""
    difference = ((one[:, None, :6] - other[None, :, :6]) ** 2).sum(axis=-1)
    same, reversed_ = (
        ((one[:, None, 6:] - sign * other[None, :, 6:]) ** 2).sum(axis=-1) for sign in (1.0, -1.0)
    )
    return difference + np.minimum(same, reversed_)


def _weighted(squared: np.ndarray, moved: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Weighted mean (n, 4) and covariance (n, 4, 4) of what the neighbours did."""
    # Against the nearest one: far from all of them the weights would vanish.
    exponent = -(squared - squared.min(axis=1, keepdims=True)) / (2 * width**2)
    weights = np.maximum(np.exp(exponent), _LEAST_WEIGHT)
    weights = np.where(np.isfinite(squared), weights, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    # The angle's mean is that of its directions: neighbours may lie on both sides of half a turn.
    mean = weights @ moved
    mean[:, 3] = np.arctan2(weights @ np.sin(moved[:, 3]), weights @ np.cos(moved[:, 3]))
    away = moved[None] - mean[:, None]
    away[..., 3] = wrap_angle(away[..., 3])
    return mean, np.einsum("nm,nmi,nmj->nij", weights, away, away)


def _loss(mean: np.ndarray, moved: np.ndarray) -> float:
    error = moved - mean
    error[:, 3] = TURN_LENGTH * wrap_angle(error[:, 3])
    return float((error**2).sum(axis=1).mean())
