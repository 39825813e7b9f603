"""Robust, precise grasps of industrial parts, with a prediction of how the part shifts in the hand.

Poses are in the robot's base frame (z up), lengths in metres, angles in radians.

    from mskgrasp import Planner, PlannerConfig, load_models, load_part, open_cell, execute_grasp

`load_part` makes a part of a CAD file, `open_cell` connects a simulated or real cell, `Planner.plan` chooses
a `Grasp` in a depth image and predicts the part's displacement in the hand, `execute_grasp` performs it, and
`open_dataset` reads collected attempts. The tutorials and the folder ``examples`` show each in use.

Names are imported when they are first used: ``import mskgrasp`` alone loads neither torch nor a simulator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mskgrasp.core.lazy_names import lazy_names
from mskgrasp.core.version import __version__ as __version__

if TYPE_CHECKING:
    from hal import Arm, Camera, Cell, RgbdFrame, Workspace, execute_grasp, open_cell
    from mskgrasp.core.errors import MskgraspError
    from mskgrasp.core.geometry import Pose
    from mskgrasp.core.grasp import Grasp, PartView
    from mskgrasp.core.shipped import config_file, example_file
    from mskgrasp.dataset import Attempts, Dataset, ShardInfo, open_dataset
    from mskgrasp.learning.grasp_models import Models, load_models
    from mskgrasp.parts.load import load_part
    from mskgrasp.parts.part import Part
    from mskgrasp.planning.config import PlannerConfig
    from mskgrasp.planning.grasp_plan import GraspPlan
    from mskgrasp.planning.place_pose import Target, place_pose
    from mskgrasp.planning.planner import Planner

__all__ = [
    "Arm", "Attempts", "Camera", "Cell", "Dataset", "Grasp", "GraspPlan", "Models", "MskgraspError", "Part",
    "PartView", "Planner", "PlannerConfig", "Pose", "RgbdFrame", "ShardInfo", "Target", "Workspace",
    "config_file", "example_file", "execute_grasp", "load_models", "load_part", "open_cell", "open_dataset",
    "place_pose",
]  # fmt: skip

_HOMES = {
    "hal": ("Arm", "Camera", "Cell", "RgbdFrame", "Workspace", "execute_grasp", "open_cell"),
    "mskgrasp.core.errors": ("MskgraspError",),
    "mskgrasp.core.geometry": ("Pose",),
    "mskgrasp.core.grasp": ("Grasp", "PartView"),
    "mskgrasp.core.shipped": ("config_file", "example_file"),
    "mskgrasp.dataset": ("Attempts", "Dataset", "ShardInfo", "open_dataset"),
    "mskgrasp.learning.grasp_models": ("Models", "load_models"),
    "mskgrasp.parts.load": ("load_part",),
    "mskgrasp.parts.part": ("Part",),
    "mskgrasp.planning.config": ("PlannerConfig",),
    "mskgrasp.planning.place_pose": ("Target", "place_pose"),
    "mskgrasp.planning.grasp_plan": ("GraspPlan",),
    "mskgrasp.planning.planner": ("Planner",),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
