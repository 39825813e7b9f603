"""The ManiSkill task ``GraspDisplacement-v1``; importing this package registers it."""

from tasks.camera import Overhead
from tasks.execution import ExecutionNoise
from tasks.grasp_displacement import REGION, GraspDisplacementEnv
from tasks.physics import Physics

__all__ = ["REGION", "ExecutionNoise", "GraspDisplacementEnv", "Overhead", "Physics"]
