"""Convex pieces of meshes against the shapes that the meshes are of."""

import math

import numpy as np
import pytest
import shapely
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.parts.recipes.cad.hulls import (
    extruded_hulls,
    half_section,
    headed_hulls,
    plane_section,
    turned_hulls,
)
from mskgrasp.parts.solids.measure import MOST_ASPECT_RATIO, aspect_ratio, hull_fit
from mskgrasp.parts.solids.solid import MAX_HULL_VERTICES


def tube(inner: float, outer: float, height: float) -> trimesh.Trimesh:
    return trimesh.creation.annulus(inner, outer, height, sections=96)


def plate(*holes_mm: float) -> trimesh.Trimesh:
    """60 x 40 x 10 mm with round holes of these radii in a row."""
    outline = shapely.box(-30, -20, 30, 20)
    for k, radius in enumerate(holes_mm):
        outline = outline.difference(shapely.Point(-15 + 30 * k, 0).buffer(radius, 32))
    return trimesh.creation.extrude_polygon(outline, 10)


def inside(hulls: list[np.ndarray], point: tuple[float, float, float]) -> bool:
    planes = [ConvexHull(points).equations for points in hulls]
    return any((plane[:, :3] @ point + plane[:, 3] < 0).all() for plane in planes)


def test_a_half_section_of_a_tube_is_its_wall():
    assert half_section(tube(12, 20, 30)).area == pytest.approx(8 * 30, rel=0.01)


def test_a_plane_cuts_holes_out_of_a_region():
    assert plane_section(plate(8), 5).area == pytest.approx(60 * 40 - math.pi * 64, rel=0.01)


def test_a_tube_keeps_its_bore_unless_it_is_to_be_filled():
    mesh = tube(12, 20, 30)
    open_, filled = turned_hulls(mesh), turned_hulls(mesh, filled=True)
    fit = hull_fit(mesh, open_)
    assert fit.p95 < 0.4 and fit.volume_ratio == pytest.approx(1, abs=0.05)
    assert not inside(open_, (1, 2, 3)) and inside(filled, (1, 2, 3))
    assert not inside(filled, (0, 20.5, 0))


def test_small_holes_of_a_plate_are_filled_and_large_ones_are_open():
    hulls = extruded_hulls(plate(3, 12), filled_mm=5)
    assert inside(hulls, (-15, 0, 5)) and not inside(hulls, (15, 0, 5))
    assert not inside(hulls, (0, 0, 10.1)) and inside(hulls, (29.9, 19.9, 9.9))


def test_a_long_thin_prism_is_cut_until_physx_accepts_it():
    hulls = extruded_hulls(trimesh.creation.box((2, 2, 140)))
    assert len(hulls) > 1
    assert max(aspect_ratio(points) for points in hulls) <= MOST_ASPECT_RATIO
    assert sum(ConvexHull(points).volume for points in hulls) == pytest.approx(2 * 2 * 140, rel=1e-6)


@pytest.mark.parametrize("flange", [0.0, 16.0], ids=["plain", "flanged"])
def test_a_hexagon_screw_has_its_head_its_flange_and_its_shank(flange: float):
    hexagon = shapely.Polygon([(10 * math.cos(a), 10 * math.sin(a)) for a in np.arange(6) * math.pi / 3])
    bodies = [
        trimesh.creation.extrude_polygon(hexagon, 8),
        trimesh.creation.cylinder(5, 40, sections=64, transform=shifted(-19.5)),
    ]
    if flange:
        bodies.append(trimesh.creation.cylinder(flange, 2, sections=64, transform=shifted(1)))
    mesh = trimesh.boolean.union(bodies)
    hulls = headed_hulls(mesh)
    assert max(len(points) for points in hulls) <= MAX_HULL_VERTICES
    fit = hull_fit(mesh, hulls)
    assert fit.p95 < 0.5 and fit.volume_ratio == pytest.approx(1, abs=0.06)
    assert inside(hulls, (9.8, 0, 7)) and not inside(hulls, (0, 9.8, 7))  # a corner, and beside a flat
    assert inside(hulls, (0, 15, 1)) == bool(flange)


def shifted(z: float) -> np.ndarray:
    return trimesh.transformations.translation_matrix([0, 0, z])
