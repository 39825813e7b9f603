"""Grasps of attempts that a planner chooses, in place of random ones.

A planner picks the grasps of which its networks expect the most, so it also picks those in which they err in
its favour. Attempts at its own choices show the networks these errors, of which random grasps hold few (the
idea of DAgger: Ross, Gordon and Bagnell 2011, arXiv 1011.0686).
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import REGION, TABLE_Z
from mskgrasp.learning.grasp_models import DESCRIPTION, WEIGHTS, load_models, require_model
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner

N_CANDIDATES = 1600
"""Half as many as a planner's by default: attempts differ more, and take less time."""
SHARES = {"recentred": 0.7, "low_variance": 0.15, "quality": 0.15}
"""Share of the attempts by each way of choosing: as a planner does by default, without recentred grasps, and
by the best quality alone."""


class PlannedGrasps:
    """Planners with a model's networks, of which each attempt draws one."""

    def __init__(self, folder: Path):
        """Load the model.

        Raises:
            MissingModel: There is none in the folder.
            BadModel: It is damaged, or predicts no variance.
        """
        models = load_models(folder)
        settings = (
            PlannerConfig(n_candidates=N_CANDIDATES),
            PlannerConfig(n_candidates=N_CANDIDATES, recentre=False),
            PlannerConfig(n_candidates=N_CANDIDATES, policy="quality"),
        )
        self._planners = [Planner(models, one, table_z=TABLE_Z, region=REGION) for one in settings]
        self._ends = np.cumsum(list(SHARES.values()))[:-1]
        self.digest = model_digest(folder)

    def choose(
        self, depth: np.ndarray, intrinsics: np.ndarray, T_base_camera: Pose, rng: np.random.Generator
    ) -> np.ndarray:
        """Choose a grasp (4,) in a depth image (h, w), metres.

        Args:
            depth: NaN where invalid.
            intrinsics: (3, 3).
            T_base_camera: Pose of the camera.
            rng: Draws the planner and its candidates.

        Raises:
            NoPartFound: No part is detected.
        """
        planner = self._planners[int(np.searchsorted(self._ends, rng.random(), side="right"))]
        frame = RgbdFrame(
            colour=np.zeros((*depth.shape, 3), np.uint8),
            depth=depth,
            intrinsics=intrinsics,
            T_base_camera=T_base_camera,
            timestamp_s=0.0,
            serial="",
        )
        return planner.plan(frame, rng).grasp.as_vector()


def model_digest(folder: Path) -> str:
    """The first half of the SHA-256 of a model's description and weights, in hex.

    Raises:
        MissingModel: There is no model in the folder.
    """
    require_model(folder)
    files = b"".join((Path(folder) / name).read_bytes() for name in (DESCRIPTION, WEIGHTS))
    return hashlib.sha256(files).hexdigest()[:32]
