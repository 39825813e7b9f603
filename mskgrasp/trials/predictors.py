"""Models of the displacement that are compared: networks, and LOWESS on grasps of the very part."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.displacement_covariance import object_displacement_covariance
from mskgrasp.core.errors import NoGraspFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PartView, centre_in_grasp_frame, to_grasp_displacement, to_object_displacement
from mskgrasp.dataset import list_shards, read_columns
from mskgrasp.learning.grasp_models import Models
from mskgrasp.planning.scoring import Scene, displacements
from mskgrasp.trials.lowess import Lowess
from mskgrasp.trials.trial import Prediction

LOWESS = "lowess"
"""The label of LOWESS among the models."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """Inputs of a predictor: a part before it is grasped.

    Attributes:
        part: Its name.
        frame: The picture of it.
        view: Where it is seen there.
        pose_base_obj: Its pose, where a tracker reports it; networks do not use it.
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
        """Whether grasps of this part were among those it was made from."""
        ...

    def predict(self, seen: Seen, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of grasps (n, 4), base frame.

        Returns:
            Mean (n, 4) of the grasp displacement and its variances (n, 4), NaN where it tells none, both
            metres and radians along the axes of the grasp frame.
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
        """Whether the part was among those of training."""
        return part in self.models.meta.training.get("training_parts", ())

    def predict(self, seen: Seen, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From the depth image alone."""
        scene = Scene.of(seen.frame, seen.view, seen.view.table_z, self.models.device)
        return displacements(self.models, scene, grasps, self.chunk_size)


@dataclass(frozen=True)
class LowessPredictor:
    """Kernel regression over the recorded grasps of each known part."""

    fits: dict[str, Lowess]
    has_variance: bool = True

    def knows(self, part: str) -> bool:
        """Whether there are recorded grasps of it."""
        return part in self.fits

    def predict(self, seen: Seen, grasps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """From the part's pose.

        Raises:
            NoGraspFound: The part, or its pose, is not known.
        """
        if seen.pose_base_obj is None or seen.part not in self.fits:
            raise NoGraspFound(f"LOWESS needs the pose of '{seen.part}' and recorded grasps of it")
        pose = seen.pose_base_obj
        n = len(grasps)
        poses = Pose(
            position=np.tile(np.asarray(pose.position, dtype=np.float64), (n, 1)),
            quat_wxyz=np.tile(np.asarray(pose.quat_wxyz, dtype=np.float64), (n, 1)),
        )
        return self.fits[seen.part].predict(poses, grasps)


def predict_one(predictor: Predictor, seen: Seen, grasp: np.ndarray, point_base: np.ndarray) -> Prediction:
    """The displacement of a part's point (3,), base frame, that a model expects of one grasp (4,)."""
    grasp = np.asarray(grasp, dtype=np.float64)
    mean, variance = predictor.predict(seen, grasp[None])
    point_grasp = centre_in_grasp_frame(np.asarray(point_base, dtype=np.float64), grasp)
    covariance = object_displacement_covariance(mean[0], variance[0], point_grasp)
    return Prediction(
        mean=to_object_displacement(mean[0], point_grasp).tolist(),
        std=np.sqrt(np.diag(covariance)).tolist(),
    )


def fit_lowess(data: Path, parts: list[str]) -> tuple[dict[str, Lowess], dict[str, str]]:
    """LOWESS of those parts of which a dataset holds at least two successful grasps.

    Returns:
        The fits by part, and the digest of the grasps that each is made from.

    Raises:
        BadDataset: The folder is no dataset, or a shard is damaged.
    """
    shards: dict[str, list[Path]] = {}
    for path in list_shards(data):
        shards.setdefault(path.stem.rsplit("-", 1)[0], []).append(path)
    fits, digests = {}, {}
    for part in parts:
        rows = [_successes(path) for path in shards.get(part, ())]
        if not rows or sum(len(grasps) for _, grasps, _ in rows) < 2:
            continue
        poses, grasps, moved = (np.concatenate(columns) for columns in zip(*rows, strict=True))
        fits[part] = Lowess.fit(Pose.from_vector(poses), grasps, moved)
        digests[part] = hashlib.sha256(poses.tobytes() + grasps.tobytes() + moved.tobytes()).hexdigest()
    return fits, digests


def _successes(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (n, 7) at rest, grasps (n, 4) and grasp displacements (n, 4) of a shard's successes."""
    rows, _ = read_columns(path, ("grasp", "success", "displacement", "pose_base_obj"))
    held = rows["success"]
    poses, grasps, displacement = (
        rows[name][held].astype(np.float64) for name in ("pose_base_obj", "grasp", "displacement")
    )
    return poses, grasps, to_grasp_displacement(displacement, centre_in_grasp_frame(poses[:, :3], grasps))
