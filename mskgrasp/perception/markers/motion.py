"""Displacement of a part from its tape squares in two images."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import MAX_OPENING, Grasp
from mskgrasp.perception.markers.find import Markers

DISTANCE_CHANGE = 0.001
"""Greatest change of the squares' distance, metres."""
SIDE_CHANGE = 0.0006
"""Greatest change of a square's side, metres; more means that it is covered or tilted."""
HEIGHT_CHANGE = 0.004
"""Greatest change of a square's height, metres; the error of a Kinect is 1 mm."""


PAD_PLAY = 0.002
"""Tolerance of a part's motion across the pads, metres: pads and surfaces are not exactly parallel."""


def planar_displacement(before: Markers, after: Markers, grasp: Grasp, centre_base: np.ndarray) -> np.ndarray:
    """Compute the part's displacement in the hand from its squares before the grasp and after placing.

    The hand has placed the part where it grasped it, so that the part moved on the table as it moved in the
    hand. The squares give this planar motion: a rotation dtheta about the midpoint m of both, and the motion
    of m. The part's origin c follows: c' = m' + Rz(dtheta) (c - m). An error e of c costs
    2 sin(dtheta / 2) |e|, 0.17 mm for 2 mm and 5 degrees.

    Args:
        before: The squares with the part at rest, before the grasp.
        after: The squares with the part placed again and the hand gone.
        grasp: The grasp as commanded.
        centre_base: (2,) or (3,) the part's origin before, base frame, metres: known, or estimated
            (`mskgrasp.perception.part_detection.view_part`).

    Returns:
        (3,) dx, dy, dtheta of the object displacement, axes of the grasp frame, metres and radians in
        [-pi, pi).

    Raises:
        MarkersNotFound: The squares of both images cannot be those of one rigid part flat on the table.
    """
    _check_same_part(before, after)
    first, second = (markers.points_base[:, :2] for markers in (before, after))
    old, new = first[1] - first[0], second[1] - second[0]
    dtheta = np.arctan2(old[0] * new[1] - old[1] * new[0], old @ new)
    from_middle = np.asarray(centre_base, dtype=np.float64)[:2] - first.mean(axis=0)
    moved = second.mean(axis=0) - first.mean(axis=0) + _rotation(dtheta) @ from_middle - from_middle
    return np.array([*(_rotation(-float(grasp.theta)) @ moved), wrap_angle(dtheta)])


def check_between_pads(displacement: np.ndarray, centre_grasp: np.ndarray, width: float) -> None:
    """Refuse a displacement that closing fingers cannot cause, as of a part dragged by the retracting hand.

    Between the pads a part moves across them no farther than the pad that pushes it.

    Args:
        displacement: (3,) dx, dy, dtheta as `planar_displacement` gives it, metres and radians.
        centre_grasp: (2,) or (3,) the part's origin before, in the grasp frame, metres.
        width: Distance of the pads as they held the part, metres.

    Raises:
        MarkersNotFound: The displacement is too large.
    """
    centre = np.asarray(centre_grasp, dtype=np.float64)[:2]
    # The point of the part that is at the TCP now, where it was before.
    before = centre - _rotation(-float(displacement[2])) @ (centre + displacement[:2])
    moved, most = abs(float(before[1])), (MAX_OPENING - width) / 2
    if not moved <= most + PAD_PLAY:
        raise MarkersNotFound(
            f"mismatch: between the pads the part seems to have moved by {1e3 * moved:.1f} mm, but they only "
            f"by {1e3 * most:.1f} mm: it was dragged along as the hand let go; leave this trial out"
        )


def _rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _check_same_part(before: Markers, after: Markers) -> None:
    old, new = (
        1e3 * float(np.linalg.norm(np.diff(markers.points_base[:, :2], axis=0)))
        for markers in (before, after)
    )
    if not abs(new - old) <= 1e3 * DISTANCE_CHANGE:
        raise MarkersNotFound(
            f"mismatch: the squares were {old:.1f} mm apart before and {new:.1f} mm after, at most "
            f"{1e3 * DISTANCE_CHANGE:g} mm of difference is noise: a square came off, or the part lies "
            "tilted; stick both on again, or leave this trial out"
        )
    risen = 1e3 * (after.points_base[:, 2] - before.points_base[:, 2])
    if not np.abs(risen).max() <= 1e3 * HEIGHT_CHANGE:
        raise MarkersNotFound(
            f"mismatch: the squares lie {risen[0]:+z.1f} and {risen[1]:+z.1f} mm higher than before, at most "
            f"{1e3 * HEIGHT_CHANGE:g} mm is noise: the part fell over, or lies on something; leave this "
            "trial out"
        )
    change = 1e3 * np.abs(after.sides - before.sides).max(axis=1)
    if not change.max() <= 1e3 * SIDE_CHANGE:
        raise MarkersNotFound(
            f"mismatch: a side of the {('larger', 'smaller')[int(change.argmax())]} square has changed by "
            f"{change.max():.1f} mm, at most {1e3 * SIDE_CHANGE:g} mm is noise: something covers it, or the "
            "part lies tilted; clear the sight, or leave this trial out"
        )
