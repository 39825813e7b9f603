"""Convex pieces from meshes of turned shapes, extruded shapes and screws."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
import trimesh
from manifold3d import Manifold, Mesh64

from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.measure import MOST_ASPECT_RATIO, aspect_ratio
from mskgrasp.parts.solids.merging import merge_hulls
from mskgrasp.parts.solids.pieces import convex_polygons, turned_pieces
from mskgrasp.parts.solids.shape import FILLED_BORE_MM, HULL_DETAIL_MM

_NOISE_MM = 0.02
"""A plane that cuts facets at any angle finds corners that differ by this much from the true profile."""


def turned_hulls(mesh: trimesh.Trimesh, *, filled: bool = False) -> list[np.ndarray]:
    """Pieces of a body of revolution about z; bolt holes, slots and sockets off the axis are filled.

    Args:
        mesh: Mesh of the shape, millimetres.
        filled: Fills what is hollow about the axis, too: the socket of a screw.
    """
    section = half_section(mesh)
    if filled:
        section = _filled(section)
    pieces = []
    for polygon in shapely.get_parts(section):
        pieces += turned_pieces(shapely.get_coordinates(polygon.exterior)[:-1].tolist(), HULL_DETAIL_MM)
    return merge_hulls(_thick(pieces))


def extruded_hulls(
    mesh: trimesh.Trimesh,
    *,
    filled_mm: float = FILLED_BORE_MM,
    detail_mm: float = HULL_DETAIL_MM,
    slack: float = 0.002,
) -> list[np.ndarray]:
    """Pieces of an outline extruded along z, by its section at half height.

    Args:
        mesh: Mesh of the shape, millimetres.
        filled_mm: Radius of the largest holes that are filled.
        detail_mm: Finer corners of the outline are left out.
        slack: Share of the volume that joining pieces may add.
    """
    low, high = (float(z) for z in mesh.bounds[:, 2])
    outline = _without_detail(plane_section(mesh, (low + high) / 2), filled_mm, detail_mm)
    pieces = merge_hulls([s.prism(piece, low, high) for piece in convex_polygons(outline)], slack)
    return [part for points in pieces for part in _cut_to_length(points, low, high)]


def headed_hulls(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    """Pieces of a screw about z whose head, above z = 0, is a hexagon, with or without a flange below it."""
    top = float(mesh.bounds[1, 2])
    hexagon = _hull_outline(plane_section(mesh, 0.55 * top))
    section = _filled(half_section(mesh, least=True))
    # The widest circle inside the hexagon; where the section is wider there is a flange.
    flat = float(min(np.abs(hexagon @ normal).max() for normal in _edge_normals(hexagon)))
    reach = float(section.bounds[2]) + 1
    above = section.intersection(shapely.box(flat + 0.2, 0, reach, top + 1))
    rest = section.intersection(shapely.box(-1, section.bounds[1] - 1, reach, 0))
    if above.area > 0.1:
        rest = rest.union(section.intersection(shapely.box(-1, 0, reach, above.bounds[3])))
    pieces = turned_pieces(_outer(rest), HULL_DETAIL_MM)
    corner = float(np.linalg.norm(hexagon, axis=1).max())
    seen = np.asarray(mesh.vertices)
    chamfered = seen[(seen[:, 2] > 0.6 * top) & (np.hypot(seen[:, 0], seen[:, 1]) < corner + 0.01)]
    head = np.concatenate([np.column_stack([hexagon, np.zeros(6)]), chamfered])
    return [s.few_corners(head), *merge_hulls(_thick(pieces))]


def half_section(mesh: trimesh.Trimesh, *, least: bool = False) -> Any:
    """The (radius, z) region of a cut through the axis, at the angle where it is largest, or smallest."""
    found = []
    for degrees in range(0, 180, 15):
        cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        points = np.asarray(mesh.vertices) @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        upright = trimesh.Trimesh(points[:, [0, 2, 1]] * [1, 1, -1], mesh.faces, process=False)
        cut = plane_section(upright, 1e-4)
        half = cut.intersection(shapely.box(0, -1e4, 1e4, 1e4)).buffer(0).simplify(_NOISE_MM)
        found.append((half.area, -degrees, half))
    chosen = (min if least else max)(found, key=lambda item: item[:2])[2]
    return shapely.set_precision(chosen, _NOISE_MM)


def plane_section(mesh: trimesh.Trimesh, z: float) -> Any:
    """The region (shapely) that a plane of constant z cuts out of a mesh."""
    body = Manifold(Mesh64(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.uint64)))
    region: Any = shapely.Polygon()
    for loop in body.slice(z).to_polygons():
        # Loops are wound by what they bound: holes clockwise; nested loops alternate.
        region = region.symmetric_difference(shapely.Polygon(np.asarray(loop)).buffer(0))
    return region


def _cut_to_length(points: np.ndarray, low: float, high: float) -> list[np.ndarray]:
    """A prism along z cut across until PhysX accepts its parts."""
    ends = points[np.abs(points[:, 2] - low) < 1e-6, :2]
    for count in range(1, 5):
        levels = np.linspace(low, high, count + 1)
        parts = [s.prism(ends, float(a), float(b)) for a, b in zip(levels[:-1], levels[1:], strict=True)]
        if aspect_ratio(parts[0]) <= 0.9 * MOST_ASPECT_RATIO:
            return parts
    return []  # a sliver of less than 0.8 mm


def _thick(pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Pieces without the slivers that a fillet's facets leave between two others."""
    return [points for points in pieces if aspect_ratio(points) <= 0.9 * MOST_ASPECT_RATIO]


def _filled(section: Any) -> Any:
    """A half section with everything between it and the axis filled."""
    swept = []
    for polygon in shapely.get_parts(section):
        corners = shapely.get_coordinates(polygon.exterior)
        for (r0, z0), (r1, z1) in zip(corners[:-1], corners[1:], strict=True):
            if z0 != z1:
                swept.append(shapely.Polygon([(0, z0), (r0, z0), (r1, z1), (0, z1)]).buffer(0))
    return shapely.set_precision(shapely.union_all(swept), _NOISE_MM)


def _without_detail(region: Any, filled_mm: float, detail_mm: float) -> Any:
    """A region without small holes and corners."""
    kept = []
    for polygon in shapely.get_parts(region):
        holes = [
            np.asarray(hole.coords)
            for hole in polygon.interiors
            if shapely.Polygon(hole).area > np.pi * filled_mm**2
        ]
        kept.append(shapely.Polygon(polygon.exterior, holes))
    return shapely.union_all(kept).simplify(detail_mm)


def _outer(region: Any) -> list[tuple[float, float]]:
    largest = max(shapely.get_parts(region), key=lambda part: part.area)
    return shapely.get_coordinates(largest.exterior)[:-1].tolist()


def _hull_outline(region: Any) -> np.ndarray:
    """The six corners of the hexagon about the axis that a region is, or nearly is."""
    corners = shapely.get_coordinates(region)
    x, y = corners[np.hypot(corners[:, 0], corners[:, 1]).argmax()]
    return s.polygon(float(np.hypot(x, y)), 6, float(np.arctan2(y, x)))


def _edge_normals(polygon: np.ndarray) -> np.ndarray:
    along = np.roll(polygon, -1, axis=0) - polygon
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)
