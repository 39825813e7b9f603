"""Least width between two contacts by which a gripper could hold a part, for each resting pose."""

from __future__ import annotations

import numpy as np

from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.parts.alike_poses import PartSurface
from mskgrasp.parts.part import Part

FRICTION = 0.8
"""Coefficient of the stickiest pads that training assumes."""
_N_POINTS = 4000
_AT_ONCE = 500


def least_widths(part: Part) -> np.ndarray:
    """Least distance of two points by which parallel fingers could hold the part from above, by resting pose.

    Two opposed contacts hold if the line between them lies within both friction cones (Nguyen 1988), and pads
    that close horizontally press within their own cones about a horizontal line. All pairs among some
    thousand points of the surface are tried; a face smaller than a thousandth of the surface can be missed.

    Args:
        part: Any part.

    Returns:
        (k,) horizontal distances, metres, for the k resting poses; inf where no pair holds.
    """
    surface = PartSurface.of(part)
    points, normals = surface.points[:_N_POINTS], surface.normals[:_N_POINTS]
    steepest = FRICTION / np.hypot(1, FRICTION)  # sine of the cone's half angle
    least_cosine = 1 / np.hypot(1, FRICTION)
    held = []
    for start in range(0, len(points), _AT_ONCE):
        line = points[None] - points[start : start + _AT_ONCE, None]
        length = np.linalg.norm(line, axis=2)
        inward = -(line * normals[start : start + _AT_ONCE, None]).sum(axis=2)
        outward = (line * normals[None]).sum(axis=2)
        held.append(line[(np.minimum(inward, outward) > least_cosine * length) & (length > 0)])
    lines = np.concatenate(held)
    length = np.linalg.norm(lines, axis=1)
    widths = []
    for vertical in quat_to_matrix(part.resting.quat_wxyz)[:, 2]:  # z of the table in the part's frame
        rise = np.abs(lines @ vertical)
        level = rise < steepest * length
        widths.append(np.sqrt(length[level] ** 2 - rise[level] ** 2).min(initial=np.inf))
    return np.array(widths)
