"""Part folder written from a solid: hulls, mass, fit and stable poses."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from scipy.spatial import ConvexHull
from trimesh.exchange.gltf import export_glb
from trimesh.exchange.ply import export_ply

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import store
from mskgrasp.parts.part import SCHEMA_VERSION, Part
from mskgrasp.parts.solids.decompose import convex_pieces, fewest_hulls
from mskgrasp.parts.solids.measure import (
    MOST_ASPECT_RATIO,
    MOST_P95_MM,
    MOST_VOLUME_RATIO,
    HullFit,
    aspect_ratio,
    hull_fit,
    longest_axis,
    mass_properties,
)
from mskgrasp.parts.solids.overlap import overlapped
from mskgrasp.parts.solids.solid import MAX_HULL_VERTICES, Solid
from mskgrasp.parts.solids.stable_poses import stable_poses

MAX_HULL_FACES = 64
MANY_HULLS = 16
"""Above this number the time of a grasp grows with every hull, so that joining them pays off."""


def with_hulls(solid: Solid) -> Solid:
    """The solid with hulls: those of its family, joined where they are many, or those of a decomposition."""
    if solid.hulls and len(solid.hulls) <= MANY_HULLS:
        return solid
    mesh = trimesh.Trimesh(np.array(solid.mesh.vertices), solid.mesh.faces, process=False)
    hulls = fewest_hulls(mesh, solid.hulls) if solid.hulls else convex_pieces(mesh)
    return Solid(mesh=solid.mesh, hulls=tuple(hulls))


def write_solid(
    solid: Solid,
    *,
    name: str,
    family: str,
    source: str,
    licence: str,
    density: float,
    dimensions: dict[str, float],
    recipe_hash: str,
    coarse: bool = False,
    origin: dict[str, Any] | None = None,
) -> Part:
    """Measure a solid, let its hulls overlap, move its centroid to the origin and store it as a part.

    Args:
        solid: Mesh and hulls, millimetres.
        name: See `Part`, as for the others.
        family: Kind of part.
        source: Origin.
        licence: SPDX identifier.
        density: kg/m^3.
        dimensions: Nominal dimensions, metres.
        recipe_hash: Hash of all that determines the part.
        coarse: Accept hulls that are farther from the mesh than those of a fine part; its grade says so.
        origin: Of an imported part, stored beside what determines it.

    Raises:
        BadPart: Its hulls are too far from its mesh, or PhysX would not take them. The caller names the part.
    """
    masses = mass_properties(solid.mesh, density)
    centroid_mm = masses.centroid * 1000
    mesh = trimesh.Trimesh(solid.mesh.vertices - centroid_mm, solid.mesh.faces, process=False)
    # Rounded to the precision of the file, so that everything measured below holds for the stored hulls.
    pieces = [_corners((points - centroid_mm).astype(np.float32)) for points in solid.hulls]
    hulls = [_corners(points.astype(np.float32)) for points in overlapped(pieces)]
    for number, points in enumerate(hulls):
        _check_hull(number, points)
    fit = hull_fit(mesh, hulls)
    if not coarse:
        _check_fit(fit)
    resting, probability = stable_poses(np.concatenate(pieces).astype(np.float64))
    record: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "name": name,
        "family": family,
        "source": source,
        "licence": licence,
        "dimensions": dimensions,
        "density": density,
        "volume": masses.volume,
        "mass": masses.mass,
        "centroid_in_source": masses.centroid,
        "inertia": masses.inertia,
        "principal_inertia": masses.principal_inertia,
        "quat_obj_principal": masses.quat_principal,
        "extents": mesh.extents / 1000,
        "longest_axis": longest_axis(mesh) / 1000,
        "n_hulls": len(hulls),
        "hulls_volume": 1e-9 * sum(ConvexHull(points.astype(np.float64)).volume for points in hulls),
        "hull_error": fit.largest / 1000,
        "hull_error_p95": fit.p95 / 1000,
        "hull_volume_ratio": fit.volume_ratio,
        "hull_outward": {"largest": fit.outward_largest / 1000, "p95": fit.outward_p95 / 1000},
        "hull_inward": {"largest": fit.inward_largest / 1000, "p95": fit.inward_p95 / 1000},
        "resting": {"position": resting.position, "quat_wxyz": resting.quat_wxyz},
        "resting_probability": probability,
        "recipe_hash": recipe_hash,
    }
    if origin is not None:
        record[store.ORIGIN] = origin
    return store.write_part(
        name, _ply(mesh), _glb(hulls), {key: _plain(value) for key, value in record.items()}
    )


def _corners(points: np.ndarray) -> np.ndarray:
    """The points that are corners of their convex hull."""
    return points[np.sort(ConvexHull(points.astype(np.float64)).vertices)]


def _check_fit(fit: HullFit) -> None:
    """Refuse hulls that deviate too far from the mesh: contacts would be those of another shape."""
    least = 1 / MOST_VOLUME_RATIO
    if fit.p95 > MOST_P95_MM or not least <= fit.volume_ratio <= MOST_VOLUME_RATIO:
        raise BadPart(
            f"the hulls deviate from the mesh: 95 % of the surface is within {fit.p95:.2f} mm (at "
            f"most {MOST_P95_MM} mm), volume ratio {fit.volume_ratio:.2f} ({least:.2f} to "
            f"{MOST_VOLUME_RATIO}): simplify fine detail such as threads, grilles and thin walls"
        )


def _check_hull(number: int, points: np.ndarray) -> None:
    faces = len(ConvexHull(points.astype(np.float64)).simplices)
    if len(points) > MAX_HULL_VERTICES or faces > MAX_HULL_FACES:
        raise BadPart(
            f"hull {number} has {len(points)} vertices and {faces} faces, "
            f"the limits are {MAX_HULL_VERTICES} and {MAX_HULL_FACES}: split it"
        )
    ratio = aspect_ratio(points.astype(np.float64))
    if ratio > MOST_ASPECT_RATIO:
        raise BadPart(
            f"hull {number} is {ratio:.0f} times longer than thick, PhysX accepts up to "
            f"{MOST_ASPECT_RATIO:.0f}: make the part thicker or shorter"
        )


def _ply(mesh_mm: trimesh.Trimesh) -> bytes:
    mesh = trimesh.Trimesh(mesh_mm.vertices / 1000, mesh_mm.faces, process=False)
    return export_ply(mesh, encoding="binary", vertex_normal=False)


def _glb(hulls_mm: list[np.ndarray]) -> bytes:
    """One node per hull. SAPIEN uses the coordinates of a GLB as they are: no rotation to y-up."""
    scene = trimesh.Scene()
    for number, points in enumerate(hulls_mm):
        hull = trimesh.convex.convex_hull(points.astype(np.float64))
        scene.add_geometry(hull, node_name=f"hull_{number:02d}", geom_name=f"hull_{number:02d}")
    return export_glb(scene, include_normals=False)


def _plain(value: Any) -> Any:
    """JSON types, floats to 9 significant digits so that rounding noise is not stored."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{float(value):.9g}") + 0.0
    if isinstance(value, (int, np.integer)):
        return int(value)
    return value
