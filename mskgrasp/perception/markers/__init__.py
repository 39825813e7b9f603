"""Displacement measurement by two tape squares on a part, imaged before a grasp and after it.

The part is imaged at rest, grasped, placed where it was grasped, and imaged again with the hand out of view.
Every failure is a `mskgrasp.core.errors.MarkersNotFound`, never a wrong number.
"""

from mskgrasp.perception.markers.find import Markers, find_markers
from mskgrasp.perception.markers.motion import check_between_pads, planar_displacement

__all__ = ["Markers", "check_between_pads", "find_markers", "planar_displacement"]
