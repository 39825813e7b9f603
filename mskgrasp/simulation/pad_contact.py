"""Where the pads of the closed hand touch a part's mesh, and whether they hold its weight there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from mskgrasp.core.geometry import quat_about_z, quat_multiply, quat_rotate
from mskgrasp.core.grasp import PAD_REACH, centre_in_grasp_frame
from mskgrasp.parts import Part

PAD_WIDTH, PAD_HEIGHT = 0.0175, 0.0185
"""Rubber tip of a finger, along and up the pads, metres (franka_description)."""
PRESSED = 1e-4
"""Depth to which a pad yields, metres: what lies no deeper than that behind the first point is touched."""
LEAST_LEVER = 1e-3
"""Lever of the friction at a single point or edge, metres: how far a real pad yields there is not known."""
_POINTS = 60_000
"""Points on a part's surface, evenly spread by area."""
_GRAVITY = 9.81
"""m/s^2"""


@dataclass(frozen=True, kw_only=True)
class Held:
    """A part in the closed hand.

    Attributes:
        resting: Index of the resting pose in which the part lay.
        grasp: (4,) in the rest frame of that pose, metres over the table and radians.
        displacement: (4,) of the part's origin in the hand, axes of the grasp frame, metres and radians.
        swing: (2,) of the part in the hand, radians about x and y of the grasp frame.
    """

    resting: int
    grasp: np.ndarray
    displacement: np.ndarray
    swing: np.ndarray

    def origin(self, part: Part) -> np.ndarray:
        """The part's origin, its centre of mass, in the grasp frame (3,), metres."""
        height = part.resting.position[self.resting, 2]
        before = centre_in_grasp_frame(np.array([0.0, 0.0, height]), self.grasp)
        return before + self.displacement[:3]

    def points(self, part: Part) -> np.ndarray:
        """Points (n, 3) on the part's mesh, evenly spread, in the grasp frame, metres."""
        angle = np.linalg.norm(self.swing)
        axis = self.swing / angle if angle > 0 else np.zeros(2)
        swung = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis), 0.0])
        turned = quat_about_z(np.asarray(self.displacement[3] - self.grasp[3]))
        lying = part.resting.quat_wxyz[self.resting]
        quat_grasp_obj = quat_multiply(swung, quat_multiply(turned, lying))
        return quat_rotate(quat_grasp_obj, _surface(part.mesh_path)) + self.origin(part)


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


def pad_contacts(part: Part, held: Held) -> list[PadContact]:
    """Find what the two pads touch of a part; none where it is not between them."""
    points = held.points(part)
    low, high = -PAD_REACH, PAD_HEIGHT - PAD_REACH
    between = points[(abs(points[:, 0]) < PAD_WIDTH / 2) & (points[:, 2] > low) & (points[:, 2] < high)]
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


def moment_share(part: Part, held: Held, friction: float) -> float:
    """Moment of a held part's weight about the closing direction, as a share of what the pads hold.

    PhysX holds a flat contact by its two farthest points, nearly twice as well as even pressure does, and a
    single point as a disc 15 mm across. So it lifts parts far from their centre of mass that would turn. Here
    each pad holds by friction where it touches the part, the weight and its moment together as far as the
    ellipsoid of the limit surface goes (Howe and Cutkosky, Practical force-motion models for sliding
    manipulation, 1996).

    Args:
        part: The part.
        held: How it lies in the hand.
        friction: Greatest friction of a pad, N.
    """
    contacts = pad_contacts(part, held)
    if not contacts:
        return np.inf
    weight = part.mass * _GRAVITY
    arm = abs(held.origin(part)[0] - np.mean([contact.along for contact in contacts]))
    left = 1 - (weight / (2 * friction)) ** 2
    most = friction * sum(contact.lever for contact in contacts) * np.sqrt(max(left, 0.0))
    return float(weight * arm / most) if most > 0 else np.inf


@lru_cache(maxsize=2)
def _surface(path: Path) -> np.ndarray:
    """Points (n, 3) on a part's mesh, obj frame, metres."""
    return np.asarray(trimesh.sample.sample_surface(trimesh.load_mesh(path), _POINTS, seed=0)[0])
