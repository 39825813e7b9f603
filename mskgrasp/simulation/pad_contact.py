"""Contact of the closed hand's pads with a part, and the moment of its weight that this holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, quat_rotate
from mskgrasp.core.grasp import MAX_OPENING, PAD_HEIGHT, PAD_REACH, PAD_WIDTH, centre_in_grasp_frame
from mskgrasp.parts import Part

PRESSED = 1e-4
"""Depth to which a pad is taken to yield, metres. That of the real rubber is not published."""
LEAST_LEVER = 1e-3
"""Lever of the friction at a single point or edge, metres: a small patch, as of a pad that yields little."""
_POINTS = 400
"""Points, spread evenly over what a pad touches, over which its lever is a mean."""
_LEAST_THICKNESS = 1e-6
"""Least distance of what one pad touches from what the other does, metres."""
_GRAVITY = 9.81
"""m/s^2"""


@dataclass(frozen=True, kw_only=True)
class HeldPart:
    """A part in the closed hand.

    Attributes:
        part: The part, whose origin is its centre of mass.
        resting: Index of the resting pose in which it lay.
        grasp: (4,) in the rest frame of that pose, metres over the table and radians.
        displacement: (4,) of the origin in the hand, axes of the grasp frame, metres and radians.
        swing: (2,) in the hand, radians about x and y of the grasp frame.
    """

    part: Part
    resting: int
    grasp: np.ndarray
    displacement: np.ndarray
    swing: np.ndarray

    @property
    def T_grasp_obj_before(self) -> Pose:
        """Pose of the part in the grasp frame before the fingers closed."""
        poses, row = self.part.resting, self.resting
        origin = centre_in_grasp_frame(np.array([0.0, 0.0, poses.position[row, 2]]), self.grasp)
        turned = quat_about_z(np.asarray(-self.grasp[3]))
        return Pose(position=origin, quat_wxyz=quat_multiply(turned, poses.quat_wxyz[row]))

    @property
    def T_grasp_obj(self) -> Pose:
        """Pose of the part in the grasp frame, in the closed hand."""
        before = self.T_grasp_obj_before
        angle = np.linalg.norm(self.swing)
        axis = self.swing / angle if angle > 0 else np.zeros(2)
        swung = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis), 0.0])
        moved = quat_multiply(swung, quat_about_z(np.asarray(self.displacement[3])))
        return Pose(
            position=before.position + self.displacement[:3],
            quat_wxyz=quat_multiply(moved, np.asarray(before.quat_wxyz)),
        )


@dataclass(frozen=True, kw_only=True)
class PadContact:
    """What both pads touch of a part, evenly pressed.

    The axis is the line through the middles of what each pad touches: no force at the middles has a moment
    about it. It is at an angle where a part jams between opposite corners of the pads.

    Attributes:
        along: Where the axis passes the part's centre of mass, x of the grasp frame, metres.
        lever: Mean distance of what a pad touches from its middle, mean of both pads, seen along the closing
            direction, metres. A friction force F of each pad, spread over its points, holds a moment of 2 F
            times this about the axis.
    """

    along: float
    lever: float


def pad_contact(held: HeldPart) -> PadContact | None:
    """Find what the pads touch; None if nothing of the part is between them.

    What lay outside the open fingers, such as the other leg of a U, is not touched.
    """
    after, before = held.T_grasp_obj, held.T_grasp_obj_before
    width, opening = PAD_WIDTH / 2, MAX_OPENING / 2
    between = _clipped(
        _mesh(held.part.mesh_path, held.part.content_hash),
        [
            (after, (-1, 0, 0), (width, 0, 0)),
            (after, (1, 0, 0), (-width, 0, 0)),
            (after, (0, 0, 1), (0, 0, -PAD_REACH)),
            (after, (0, 0, -1), (0, 0, PAD_HEIGHT - PAD_REACH)),
            (before, (0, -1, 0), (0, opening, 0)),
            (before, (0, 1, 0), (0, -opening, 0)),
        ],
    )
    if not len(between.faces):
        return None
    y = after.apply(np.asarray(between.vertices))[:, 1]
    (left, left_lever), (right, right_lever) = (
        _touched(between, after, np.array([0.0, side, 0.0]), (side * y).max() - PRESSED) for side in (-1, 1)
    )
    share = (float(after.position[1]) - y.min()) / max(np.ptp(y), _LEAST_THICKNESS)
    along = (1 - share) * left + share * right
    return PadContact(along=along, lever=max((left_lever + right_lever) / 2, LEAST_LEVER))


def moment_share(held: HeldPart, friction_force: float) -> float:
    """Moment of a held part's weight about the line through the pads' contacts, as a share of what they hold.

    PhysX holds a flat contact by its two farthest points, nearly twice as well as even pressure does, and a
    single point as a disc. So it lifts parts far from their centre of mass that would turn. Here each pad
    holds by friction where it touches the part, the weight and its moment together as far as the ellipsoid of
    the limit surface goes (Howe and Cutkosky, Practical force-motion models for sliding manipulation, 1996),
    of both pads as of one.

    Args:
        held: The part in the hand, at the mean of its outcomes.
        friction_force: Greatest friction of a pad, N.
    """
    contact = pad_contact(held)
    weight = held.part.mass * _GRAVITY
    if contact is None or friction_force <= weight / 2:
        return np.inf
    left = 1 - (weight / (2 * friction_force)) ** 2
    arm = abs(float(held.T_grasp_obj.position[0]) - contact.along)
    return float(weight * arm / (2 * friction_force * contact.lever * np.sqrt(left)))


def _touched(
    mesh: trimesh.Trimesh, T_grasp_obj: Pose, outward: np.ndarray, least: float
) -> tuple[float, float]:
    """Middle, x of the grasp frame, of what lies so far outward, and mean distance from it, metres."""
    layer = _clipped(mesh, [(T_grasp_obj, outward, least * outward)])
    facing = abs(quat_rotate(T_grasp_obj.quat_wxyz, layer.face_normals) @ outward)
    weights = layer.area_faces * facing
    if weights.sum() > 0:
        middle = np.average(layer.triangles_center, axis=0, weights=weights)
        points = trimesh.sample.sample_surface(layer, _POINTS, face_weight=weights, seed=0)[0]
    else:  # an edge between faces along the closing direction
        points = np.asarray(layer.vertices)
        middle = points.mean(axis=0)
    x, _, z = T_grasp_obj.apply(np.vstack([middle, points])).T
    return float(x[0]), float(np.hypot(x[1:] - x[0], z[1:] - z[0]).mean())


def _clipped(mesh: trimesh.Trimesh, planes: list) -> trimesh.Trimesh:
    """What lies on the inner side of planes: each a frame's pose, and in it the normal and a point."""
    normals = [quat_rotate(pose.inverse().quat_wxyz, np.array(normal, float)) for pose, normal, _ in planes]
    origins = [pose.inverse().apply(np.array(point, float)) for pose, _, point in planes]
    clipped = trimesh.intersections.slice_mesh_plane(mesh, np.array(normals), np.array(origins))
    assert clipped is not None
    return clipped


@lru_cache(maxsize=2)
def _mesh(path: Path, content_hash: str) -> trimesh.Trimesh:
    # The hash is for the cache alone: the file may be another by then.
    return trimesh.load_mesh(path, process=False)
