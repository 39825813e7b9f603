"""Grasps of attempts that a planner chooses, in place of random ones.

A planner takes the grasps with the highest predictions, among them those whose predictions are too high.
Random grasps hold few of these; attempts at the planner's own choices show them to the networks that learn
next (the idea of DAgger: Ross, Gordon and Bagnell 2011, arXiv 1011.0686).
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.errors import BadModel
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
SETTINGS = {
    "recentred": PlannerConfig(n_candidates=N_CANDIDATES),
    "low_variance": PlannerConfig(n_candidates=N_CANDIDATES, recentre=False),
    "quality": PlannerConfig(n_candidates=N_CANDIDATES, policy="quality"),
}


class PlannedGrasps:
    """Planners with a model's networks, of which each attempt draws one."""

    def __init__(self, folder: Path):
        """Load the model.

        Raises:
            MissingModel: There is none in the folder.
            BadModel: It is damaged, or predicts no variance.
        """
        models = load_models(folder)
        if not models.meta.network.variance:
            raise BadModel(
                f"the model in {folder} predicts no variance, by which grasps are chosen; name another"
            )
        self._planners = [Planner(models, SETTINGS[name], table_z=TABLE_Z, region=REGION) for name in SHARES]
        self._ends = np.cumsum(list(SHARES.values()))[:-1]
        self.digest = planner_digest(folder)

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
            TableTooHigh: The table is seen too high.
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


def planner_digest(folder: Path) -> str:
    """Half of the SHA-256, in hex, of a model's files and of the settings of the planners with it.

    Raises:
        MissingModel: There is no model in the folder.
    """
    require_model(folder)
    files = b"".join((Path(folder) / name).read_bytes() for name in (DESCRIPTION, WEIGHTS))
    settings = [(name, share, SETTINGS[name].model_dump(mode="json")) for name, share in SHARES.items()]
    return hashlib.sha256(files + json.dumps(settings).encode()).hexdigest()[:32]
