"""Where the pads of the closed hand touch a part, by its mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, quat_rotate
from mskgrasp.core.grasp import PAD_REACH, centre_in_grasp_frame
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasp

PAD_WIDTH, PAD_HEIGHT = 0.0175, 0.0185
"""Rubber tip of a finger, along and up the pads, metres (franka_description)."""
PRESSED = 1e-4
"""Depth to which a pad yields, metres: what lies no deeper than that behind the first point is touched."""
LEAST_LEVER = 1e-3
"""Lever of the friction at a single point or edge, metres: how far a real pad yields there is not known."""
_POINTS = 60_000
"""Points on a part's surface, evenly spread by area."""


@dataclass(frozen=True, kw_only=True)
class PadContact:
    """Contact of one pad, about evenly pressed.

    Attributes:
        along: Its middle along the pad, x of the grasp frame, metres.
        lever: Mean distance of its points from that middle, metres: by friction F in all of them it resists
            turning about the closing direction by F times this.
    """

    along: float
    lever: float


def pad_contacts(part: Part, one: CertifiedGrasp) -> list[PadContact]:
    """Find what the pads touch once the hand has closed; a pad that touches nothing has no contact.

    Args:
        part: The part.
        one: A grasp of it, with the mean displacement and swing of the part in the hand.
    """
    lying = Pose(position=part.resting.position[one.resting], quat_wxyz=part.resting.quat_wxyz[one.resting])
    origin = centre_in_grasp_frame(np.asarray(lying.position), one.grasp) + one.mean[:3]
    angle = np.linalg.norm(one.swing)
    axis = one.swing / angle if angle > 0 else np.zeros(2)
    swung = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis), 0.0])
    turned = quat_about_z(np.asarray(one.mean[3] - one.grasp[3]))
    quat_grasp_obj = quat_multiply(quat_multiply(swung, turned), np.asarray(lying.quat_wxyz))
    held = quat_rotate(quat_grasp_obj, _surface(part.mesh_path)) + origin
    low, high = -PAD_REACH, PAD_HEIGHT - PAD_REACH
    between = held[(abs(held[:, 0]) < PAD_WIDTH / 2) & (held[:, 2] > low) & (held[:, 2] < high)]
    if not len(between):
        return []
    found = []
    for side in (1, -1):
        towards = side * between[:, 1]
        touched = between[towards > towards.max() - PRESSED][:, [0, 2]]
        middle = touched.mean(axis=0)
        lever = float(np.linalg.norm(touched - middle, axis=1).mean())
        found.append(PadContact(along=float(middle[0]), lever=max(lever, LEAST_LEVER)))
    return found


@lru_cache(maxsize=2)
def _surface(path: Path) -> np.ndarray:
    """Points (n, 3) on a part's mesh, obj frame, metres."""
    return np.asarray(trimesh.sample.sample_surface(trimesh.load_mesh(path), _POINTS, seed=0)[0])
