"""Grasps beside the middle of a box, whose outcome follows from its edges."""

from __future__ import annotations

import dataclasses

import numpy as np

from hal import RgbdFrame
from mskgrasp.core.grasp import Grasp
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.trials.engine import PlannedGrasp, TrialEngine
from tests.planning.hand_made import planner

SIZE = (0.06, 0.02, 0.03)
"""Edges of the box, m: lying flat, the fingers fit over the second."""


@dataclasses.dataclass
class BoxCell:
    """The engine of a cell with the box, which lies flat with this seed."""

    engine: TrialEngine
    part: str
    seed: int

    def lies_flat(self) -> bool:
        assert self.engine.cell.feeder is not None
        self.engine.cell.feeder.present(self.part, self.seed)
        pose = self.engine.part_pose()
        return pose is not None and abs(pose.as_matrix()[2, 2]) > 0.99

    def present(self, along: float = 0.0, across: float = 0.0, up: float = 0.0) -> PlannedGrasp:
        """The box presented, with a plan to grasp it beside its middle, metres along its own edges."""
        return self.engine.present(self.part, self.seed, BesideTheMiddle(self.engine, along, across, up))


@dataclasses.dataclass(frozen=True)
class BesideTheMiddle:
    """A planner that knows the true pose, and expects what a hand-made network says."""

    engine: TrialEngine
    along: float
    across: float
    up: float

    def plan(self, frame: RgbdFrame, rng: np.random.Generator) -> GraspPlan:
        plan = planner(PlannerConfig(n_candidates=20)).plan(frame, rng)
        pose = self.engine.part_pose()
        assert pose is not None
        long = pose.as_matrix()[:3, 0]
        theta = (np.arctan2(long[1], long[0]) + np.pi / 2) % np.pi - np.pi / 2
        x_grasp = np.array([np.cos(theta), np.sin(theta), 0.0])
        y_grasp = np.array([-np.sin(theta), np.cos(theta), 0.0])
        x, y, z = pose.position + self.along * x_grasp + self.across * y_grasp
        return dataclasses.replace(plan, grasp=Grasp.from_vector(np.array([x, y, z + self.up, theta])))
