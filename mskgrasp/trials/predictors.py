"""Models of the grasp displacement: networks, and LOWESS over grasps of the same part."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.displacement_covariance import object_displacement_covariance
from mskgrasp.core.errors import BadDataset, NoGraspFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import (
    Grasp,
    PartView,
    centre_in_grasp_frame,
    to_grasp_displacement,
    to_object_displacement,
)
from mskgrasp.dataset import list_shards, read_columns
from mskgrasp.learning.grasp_models import Models
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.scoring import Scene, displacements
from mskgrasp.trials.lowess import Lowess
from mskgrasp.trials.trial import Prediction, Trial

LOWESS = "lowess"
"""The label of LOWESS among the models."""


@dataclass(frozen=True, kw_only=True)
class PartObservation:
    """Input of a predictor: a part at rest before the grasp.

    Attributes:
        part: Name of the part.
        frame: The frame.
        view: The part as detected in the frame.
        pose_base_obj: Pose of the part; None without a tracker. Networks ignore it.
    """

    part: str
    frame: RgbdFrame
    view: PartView
    pose_base_obj: Pose | None


class Predictor(Protocol):
    """A model of the grasp displacement."""

    @property
    def has_variance(self) -> bool:
        """Whether it predicts variances."""
        ...

    def knows(self, part: str) -> bool:
        """Whether the model was trained on grasps of this part."""
        ...

    def predict(self, observation: PartObservation, grasps: Grasp) -> tuple[np.ndarray, np.ndarray]:
        """Predict the grasp displacement of n grasps.

        Returns:
            Mean (n, k) of the grasp displacement and its variances (n, k), NaN where it predicts none, both
            metres and radians along the axes of the grasp frame; k is 6 where it predicts the swing, too,
            otherwise 4.
        """
        ...


@dataclass(frozen=True)
class NetworkPredictor:
    """A trained displacement network."""

    models: Models
    chunk_size: int

    @property
    def has_variance(self) -> bool:
        """Whether the network was trained with variances."""
        return self.models.meta.network.variance

    def knows(self, part: str) -> bool:
        """Whether the part is a training part."""
        return part in self.models.meta.training.get("training_parts", ())

    def predict(self, observation: PartObservation, grasps: Grasp) -> tuple[np.ndarray, np.ndarray]:
        """Predict from the depth image."""
        scene = Scene.of(observation.frame, observation.view, observation.view.table_z, self.models.device)
        return displacements(self.models, scene, grasps.as_vector(), self.chunk_size)


@dataclass(frozen=True)
class LowessPredictor:
    """LOWESS of each known part."""

    fits: dict[str, Lowess]
    has_variance: bool = True

    def knows(self, part: str) -> bool:
        """Whether there is a fit of the part."""
        return part in self.fits

    def predict(self, observation: PartObservation, grasps: Grasp) -> tuple[np.ndarray, np.ndarray]:
        """Predict from the part's pose.

        Raises:
            NoGraspFound: The part or its pose is unknown.
        """
        if observation.pose_base_obj is None or observation.part not in self.fits:
            raise NoGraspFound(f"LOWESS needs the pose of '{observation.part}' and recorded grasps of it")
        pose = observation.pose_base_obj
        n = len(grasps)
        poses = Pose(
            position=np.tile(np.asarray(pose.position, dtype=np.float64), (n, 1)),
            quat_wxyz=np.tile(np.asarray(pose.quat_wxyz, dtype=np.float64), (n, 1)),
        )
        return self.fits[observation.part].predict(poses, grasps.as_vector())


def predict_one(
    predictor: Predictor, observation: PartObservation, grasp: Grasp, point_base: np.ndarray
) -> Prediction:
    """Predict the displacement of a part's point (3,), base frame, for one grasp."""
    vector = np.asarray(grasp.as_vector(), dtype=np.float64)
    mean, variance = predictor.predict(observation, Grasp.from_vector(vector[None]))
    point_grasp = centre_in_grasp_frame(np.asarray(point_base, dtype=np.float64), vector)
    covariance = object_displacement_covariance(mean[0, :4], variance[0, :4], point_grasp)
    return Prediction(
        mean=to_object_displacement(mean[0], point_grasp).tolist(),
        std=np.sqrt(np.diag(covariance)).tolist(),
    )


def missing_predictions(trial: Trial, predictors: Mapping[str, Predictor]) -> dict[str, Predictor]:
    """Models of which a trial lacks a prediction, by label: none unless its best grasp was measured."""
    if trial.measured is None or trial.point_base is None or trial.chosen_by:
        return {}
    return {
        label: one
        for label, one in predictors.items()
        if label not in trial.predictions and (label != LOWESS or one.knows(trial.part))
    }


def predicted_by(
    predictors: Mapping[str, Predictor], trial: Trial, frame: RgbdFrame, plan: GraspPlan
) -> Trial:
    """Add the predictions of models for a trial's grasp, from its frame and plan."""
    pose = None if trial.pose_base_obj is None else Pose.from_vector(np.array(trial.pose_base_obj))
    observation = PartObservation(part=trial.part, frame=frame, view=plan.view, pose_base_obj=pose)
    point = np.array(trial.point_base)
    more = {label: predict_one(one, observation, plan.grasp, point) for label, one in predictors.items()}
    return replace(trial, predictions=trial.predictions | more)


def fit_lowess(data: Path, parts: Mapping[str, str]) -> tuple[dict[str, Lowess], dict[str, str]]:
    """Fit LOWESS to each part of which a dataset holds at least two successful grasps.

    Args:
        data: Folder of the dataset.
        parts: Content hashes of the parts, by name: in another version a part may have other axes.

    Returns:
        Fits by part, and the digest of the grasps of each.

    Raises:
        BadDataset: The folder is not a dataset, a shard is damaged, or its part has changed since.
    """
    shards: dict[str, list[Path]] = {}
    for path in list_shards(data):
        shards.setdefault(path.stem.rsplit("-", 1)[0], []).append(path)
    fits, digests = {}, {}
    for part, content_hash in parts.items():
        rows = [_successes(path, content_hash) for path in shards.get(part, ())]
        if not rows or sum(len(grasps) for _, grasps, _ in rows) < 2:
            continue
        poses, grasps, moved = (np.concatenate(columns) for columns in zip(*rows, strict=True))
        fits[part] = Lowess.fit(Pose.from_vector(poses), grasps, moved)
        digests[part] = hashlib.sha256(poses.tobytes() + grasps.tobytes() + moved.tobytes()).hexdigest()
    return fits, digests


def _successes(path: Path, content_hash: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (n, 7) at rest, grasps (n, 4) and grasp displacements (n, 4) of a shard's successes."""
    rows, info = read_columns(path, ("grasp", "success", "displacement", "pose_base_obj"))
    if info.part_hash != content_hash:
        raise BadDataset(
            f"{path}: part '{info.part}' has changed since it was grasped; collect its grasps again"
        )
    held = rows["success"]
    poses, grasps, displacement = (
        rows[name][held].astype(np.float64) for name in ("pose_base_obj", "grasp", "displacement")
    )
    return poses, grasps, to_grasp_displacement(displacement, centre_in_grasp_frame(poses[:, :3], grasps))
