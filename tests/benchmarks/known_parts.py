"""Grasps of parts that are trained on: some are held out of training, LOWESS is fitted to the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import pose_base_grasp, to_grasp_displacement
from mskgrasp.dataset import open_dataset, read_columns
from mskgrasp.learning.samples import Samples
from mskgrasp.trials.lowess import Lowess
from tests.benchmarks.choice import Predictions

HELD_OUT_EVERY = 4
"""One in so many attempts at a known part is held out of training."""
_LEAST_SUCCESSES = 8
"""Fewest successes of a known part, so that a fit and a measurement remain of it."""
_SAME = 1e-6
"""Grasps that differ by less, metres and quaternion components, are the same attempt."""
_LEAST_VARIANCE = 1e-12
"""Of a fit far from all but one grasp, metres and radians squared."""


def evenly(items: Sequence[int], n: int) -> list[int]:
    """n of some items, evenly spaced; all where there are fewer."""
    return [items[int(i)] for i in np.linspace(0, len(items) - 1, min(n, len(items)))]


def held_out_rows(samples: Samples, training: Tensor, n_parts: int) -> Tensor:
    """Rows of training parts that are held out of training: every fourth attempt at each of some parts.

    Args:
        samples: The dataset.
        training: Rows of the training parts.
        n_parts: Number of known parts, chosen evenly by name from those with enough successes.
    """
    part, success = samples.part[training], samples.success[training]
    counts = torch.bincount(part[success], minlength=len(samples.parts))
    enough = torch.nonzero(counts >= _LEAST_SUCCESSES)[:, 0].tolist()
    chosen = sorted(evenly(sorted(enough, key=lambda number: samples.parts[number]), n_parts))
    rows = [training[part == number][::HELD_OUT_EVERY] for number in chosen]
    return torch.cat(rows) if rows else training[:0]


def lowess_predictions(samples: Samples, rows: Tensor, training: Tensor, more: Path | None) -> Predictions:
    """Predict with LOWESS for held-out rows, from other recorded grasps of the same parts.

    Args:
        samples: The dataset.
        rows: Held-out rows of known parts.
        training: Rows to fit to.
        more: Dataset with more attempts at these parts; those that are held out are not used again.
    """
    held, fit = rows[samples.success[rows]], training[samples.success[training]]
    mean, variance = np.zeros((len(held), 4)), np.full((len(held), 4), np.nan)
    for number in torch.unique(samples.part[held]).tolist():
        here = samples.part[held] == number
        asked = poses(samples, held[here])
        own = fit[samples.part[fit] == number]
        known, moved = poses(samples, own), samples.grasp_displacement[own].double().numpy()
        if more is not None:
            # Which of its attempts training has seen does not matter: each is used once.
            known, moved = recorded_grasps(more, samples.parts[number])
            nearest = np.abs(known[:, None] - poses(samples, rows[samples.part[rows] == number])).max(axis=2)
            known, moved = (values[nearest.min(axis=1) > _SAME] for values in (known, moved))
        # In the grasp frame every grasp is the identity, and the part lies where the pose says.
        model = Lowess.fit(Pose.from_vector(known), np.zeros((len(known), 4)), moved)
        predicted = model.predict(Pose.from_vector(asked), np.zeros((len(asked), 4)))
        mean[here], variance[here] = predicted[0], np.maximum(predicted[1], _LEAST_VARIANCE)
    return Predictions(quality=np.zeros(0), mean=mean, variance=variance)


def poses(samples: Samples, rows: Tensor) -> np.ndarray:
    """True poses (n, 7) of the part in the grasp frame, x y z qw qx qy qz."""
    return torch.cat([samples.origin_grasp[rows], samples.quat_grasp_obj[rows]], dim=1).double().numpy()


def recorded_grasps(data: Path, part: str) -> tuple[np.ndarray, np.ndarray]:
    """Successful grasps of a part in a dataset.

    Returns:
        Poses (n, 7) of the part in the grasp frame, and grasp displacements (n, 4).
    """
    found = []
    for path in open_dataset(data).paths:
        if path.stem.rpartition("-")[0] != part:
            continue
        columns, _ = read_columns(path, ("grasp", "success", "displacement", "pose_base_obj"))
        held = columns["success"]
        grasp, pose, displacement = (
            columns[name][held].astype(np.float64) for name in ("grasp", "pose_base_obj", "displacement")
        )
        T_grasp_obj = pose_base_grasp(grasp).inverse() @ Pose.from_vector(pose)
        moved = to_grasp_displacement(displacement, T_grasp_obj.position)
        found.append((T_grasp_obj.as_vector().astype(np.float32).astype(np.float64), moved))
    if not found:
        return np.zeros((0, 7)), np.zeros((0, 4))
    return np.concatenate([one for one, _ in found]), np.concatenate([one for _, one in found])
