"""Resting pose, place and turn of a part with known CAD, from one depth image."""

from __future__ import annotations

from mskgrasp.perception.part_pose.known_part import KnownPart
from mskgrasp.perception.part_pose.part_pose import PartPose, PossiblePose, find_part_pose

__all__ = ["KnownPart", "PartPose", "PossiblePose", "find_part_pose"]
