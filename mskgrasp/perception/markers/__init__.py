"""Measuring without knowing the truth: two tape squares on a part, before a grasp and after it.

A picture of the part at rest, the grasp, the part put down again where it was grasped, the hand out of sight,
another picture. Whatever may be wrong is `mskgrasp.core.errors.MarkersNotFound`, never a number.
"""

from mskgrasp.perception.markers.find import Markers, find_markers
from mskgrasp.perception.markers.motion import check_between_pads, planar_displacement

__all__ = ["Markers", "check_between_pads", "find_markers", "planar_displacement"]
