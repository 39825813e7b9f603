"""Decimation of meshes within a measured distance."""

from __future__ import annotations

import numpy as np
import trimesh
from manifold3d import Manifold
from scipy.spatial import KDTree

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.solids.surface import Surface, manifold_of, surface_of

MANY_TRIANGLES = 50_000
"""Meshes of more are decimated: neither pictures nor contacts gain from them."""

MOST_TRIANGLES_LEFT = 200_000

TOLERANCES_MM = (0.01, 0.02, 0.04)
"""Tolerances of single edge collapses, tried in turn; the resulting distance is measured."""

MOST_MOVED_MM = 0.05
"""Largest distance between the surfaces; common CAD tessellations are about as far from the true one."""

COLLISION_TRIANGLES = 6_000
COLLISION_TOLERANCES_MM = (0.01, 0.02, 0.05, 0.1, 0.2)
"""Convex decomposition takes time for each triangle, and its pieces deviate by tenths of a millimetre."""

_FINE = 1 / 400
"""Coarsest tolerance for small parts, as a share of the part's length."""

_SAMPLES = 40_000


def decimate(body: Manifold) -> tuple[Manifold, str | None]:
    """The body with fewer triangles, and a sentence that reports it; the same body where it has few.

    Raises:
        BadPart: Too many triangles are left.
    """
    before = body.num_tri()
    if before <= MANY_TRIANGLES:
        return body, None
    chosen, moved = body, 0.0
    for tolerance in TOLERANCES_MM:
        simpler = body.simplify(tolerance)
        distance = surface_distance(body, simpler)
        if distance > MOST_MOVED_MM:
            break
        chosen, moved = simpler, distance
        if chosen.num_tri() <= MANY_TRIANGLES:
            break
    after = chosen.num_tri()
    if after > MOST_TRIANGLES_LEFT:
        raise BadPart(
            f"has {before:,} triangles, and {after:,} when decimated within {MOST_MOVED_MM} mm, "
            f"the most is {MOST_TRIANGLES_LEFT:,} (a rough scan?): decimate it, for example in MeshLab"
        )
    if after == before:
        return body, None
    return chosen, (
        f"decimated from {before:,} to {after:,} triangles, the surface moved by at most {moved:.3f} mm"
    )


def for_collision(mesh_mm: trimesh.Trimesh) -> trimesh.Trimesh:
    """A coarser mesh for convex decomposition, at most 0.2 mm away; the same mesh where it is coarse."""
    if len(mesh_mm.faces) <= COLLISION_TRIANGLES:
        return mesh_mm
    body = manifold_of(Surface(vertices=np.asarray(mesh_mm.vertices), faces=np.asarray(mesh_mm.faces)))
    limit = max(COLLISION_TOLERANCES_MM[0], _FINE * float(np.max(mesh_mm.extents)))
    tolerances = tuple(tolerance for tolerance in COLLISION_TOLERANCES_MM if tolerance <= limit)
    coarse = surface_of(_coarsened(body, COLLISION_TRIANGLES, tolerances))
    return trimesh.Trimesh(coarse.vertices, coarse.faces, process=False)


def surface_distance(before: Manifold, after: Manifold) -> float:
    """Largest distance of 40,000 points of a surface from its simplified one, mm."""
    size = np.asarray(after.bounding_box()).reshape(2, 3)
    # Refined, so that the nearest triangle is among those with the nearest centres.
    target = surface_of(after.refine_to_length(float((size[1] - size[0]).max()) / 100)).triangles
    surface = surface_of(before)
    chosen = surface.vertices[surface.faces[:: max(1, 2 * len(surface.faces) // _SAMPLES)]]
    points = np.concatenate([chosen[:, 0], chosen.mean(axis=1)])
    near = KDTree(target.mean(axis=1)).query(points, k=min(24, len(target)))[1].reshape(len(points), -1)
    best = np.full(len(points), np.inf)
    for column in near.T:
        closest = trimesh.triangles.closest_point(target[column], points)
        best = np.minimum(best, np.linalg.norm(closest - points, axis=1))
    return float(best.max())


def _coarsened(body: Manifold, enough: int, tolerances_mm: tuple[float, ...]) -> Manifold:
    """Simplified by the smallest tolerance that leaves few enough triangles, or by the largest."""
    simpler = body
    for tolerance in tolerances_mm:
        simpler = body.simplify(tolerance)
        if simpler.num_tri() <= enough:
            break
    return simpler
