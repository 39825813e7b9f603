"""The ManiSkill task ``GraspDisplacement-v1``; importing this package registers it."""

from tasks.grasp_displacement import GraspDisplacementEnv

__all__ = ["GraspDisplacementEnv"]
