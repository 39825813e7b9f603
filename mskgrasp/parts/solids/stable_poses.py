"""Stable poses of a part on a table, and how often each occurs.

The quasi-static model of Goldberg et al., "Part pose statistics" (1999): a part dropped in a uniformly
random orientation lands on the facet of its convex hull that lies below its centre of mass, and rolls over
an edge onto the next facet wherever the centre of mass projects outside the facet it stands on.

Our own implementation: `trimesh.poses.compute_stable_poses` gives the same poses and probabilities
for 22 of the 25 starter parts, but has no margin: socket_screw_m10x60 would rest in a quarter of its drops
on facets whose border is 0.015 mm from the centre's projection, where a touch tips it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from mskgrasp.core.geometry import Pose, quat_from_matrix

SAME_FACET_ANGLE = np.radians(0.5)
MARGIN_MM = 0.3
LEAST_PROBABILITY = 0.005
MOST_POSES = 64


@dataclass(frozen=True, kw_only=True)
class Facet:
    """Facet of the convex hull that the part may rest on.

    Attributes:
        normal: (3,) unit, out of the part.
        landing: Probability of landing on it.
        margin: Distance of the centre's projection from the nearest border, negative outside, mm.
        neighbour: Facet across that border.
    """

    normal: np.ndarray
    landing: float
    margin: float
    neighbour: int


def stable_poses(points_obj_mm: np.ndarray) -> tuple[Pose, np.ndarray]:
    """The stable poses of a body, most probable first.

    Args:
        points_obj_mm: (n, 3) points whose convex hull touches the table; the centre of mass is the origin.

    Returns:
        T_table_obj of the k poses (metres, x = y = 0, lowest point at z = 0) and their probabilities (k,),
        which sum to 1. Poses under 0.5 %, and those whose centre of mass projects closer than 0.3 mm to the
        border of the support, are left out unless nothing else remains.
    """
    facets = hull_facets(points_obj_mm)
    probability = np.zeros(len(facets))
    for index, facet in enumerate(facets):
        probability[_roll(facets, index)] += facet.landing
    if not probability.any():
        # Numerically no facet is stable: the one with the widest margin is taken.
        probability[int(np.argmax([facet.margin for facet in facets]))] = 1.0
    order = np.argsort(-probability, kind="stable")
    kept = [i for i in order if probability[i] >= LEAST_PROBABILITY * probability.sum()][:MOST_POSES]
    kept = kept or [int(order[0])]
    rotations = np.stack([_down(facets[i].normal) for i in kept])
    quats = quat_from_matrix(rotations)
    lowest = np.stack([(points_obj_mm @ rotation[2]).min() for rotation in rotations])
    position = np.zeros((len(kept), 3))
    position[:, 2] = -lowest / 1000
    return Pose(position=position, quat_wxyz=quats), probability[kept] / probability[kept].sum()


def hull_facets(points: np.ndarray) -> list[Facet]:
    """The facets of the convex hull of points (n, 3), coplanar triangles joined."""
    hull = ConvexHull(points)
    group = _coplanar_groups(hull)
    solid_angle = _solid_angles(points[hull.simplices])
    areas = _areas(points[hull.simplices])
    facets = []
    for number in range(group.max() + 1):
        members = np.flatnonzero(group == number)
        normal = (areas[members, None] * hull.equations[members, :3]).sum(axis=0)
        normal /= np.linalg.norm(normal)
        margin, neighbour = _nearest_border(hull, points, group, members, normal)
        landing = float(solid_angle[members].sum() / solid_angle.sum())
        facets.append(Facet(normal=normal, landing=landing, margin=margin, neighbour=neighbour))
    return facets


def _roll(facets: list[Facet], index: int) -> int:
    """The facet on which a body that lands on facet ``index`` comes to rest."""
    seen: list[int] = []
    while facets[index].margin < MARGIN_MM:
        if index in seen:
            # A body that rolls in a cycle stays on the facet with the widest margin.
            return max(seen[seen.index(index) :], key=lambda i: facets[i].margin)
        seen.append(index)
        index = facets[index].neighbour
    return index


def _coplanar_groups(hull: ConvexHull) -> np.ndarray:
    """A group number for each triangle; neighbours with nearly the same normal share one."""
    group = np.full(len(hull.simplices), -1)
    count = 0
    for start in range(len(group)):
        if group[start] >= 0:
            continue
        reference = hull.equations[start, :3]
        group[start] = count
        stack = [start]
        while stack:
            for other in hull.neighbors[stack.pop()]:
                # Compared with the first triangle, not pairwise: a round surface must not become one facet.
                if group[other] < 0 and _angle(reference, hull.equations[other, :3]) < SAME_FACET_ANGLE:
                    group[other] = count
                    stack.append(other)
        count += 1
    return group


def _nearest_border(
    hull: ConvexHull, points: np.ndarray, group: np.ndarray, members: np.ndarray, normal: np.ndarray
) -> tuple[float, int]:
    """Distance of the origin's projection from the facet's border, and the facet beyond."""
    middle = points[np.unique(hull.simplices[members])].mean(axis=0)
    best = (np.inf, -1)
    for member in members:
        for corner, other in enumerate(hull.neighbors[member]):
            if group[other] == group[member]:
                continue
            a, b = points[np.delete(hull.simplices[member], corner)]
            inward = np.cross(normal, b - a)
            length = np.linalg.norm(inward)
            if length < 1e-9:
                continue
            inward *= np.sign(inward @ (middle - a)) / length
            distance = float(inward @ -a)
            if distance < best[0]:
                best = (distance, int(group[other]))
    return best


def _solid_angles(triangles: np.ndarray) -> np.ndarray:
    """Solid angles (n,) of triangles (n, 3, 3) seen from the origin (Van Oosterom and Strackee, 1983)."""
    length = np.linalg.norm(triangles, axis=-1)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    triple = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    below = (
        length.prod(axis=1)
        + np.einsum("ij,ij->i", a, b) * length[:, 2]
        + np.einsum("ij,ij->i", b, c) * length[:, 0]
        + np.einsum("ij,ij->i", c, a) * length[:, 1]
    )
    return 2 * np.arctan2(triple, below)


def _areas(triangles: np.ndarray) -> np.ndarray:
    return (
        np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
        / 2
    )


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(2 * np.arcsin(min(1.0, float(np.linalg.norm(a - b)) / 2)))


def _down(normal: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) that turns ``normal`` to -z; half a turn about x where it is +z."""
    target = np.array([0.0, 0.0, -1.0])
    cosine = float(normal @ target)
    if cosine < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    axis = np.cross(normal, target)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1 + cosine)
