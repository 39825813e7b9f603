"""Convex pieces of a mesh cut into layers, whose sections are split into convex polygons.

Exact for extrusions, and for bodies of several extrusions along one direction, as most machined and printed
parts are; slopes and roundings become steps within a tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
import trimesh
from manifold3d import Manifold, Mesh64

from mskgrasp.parts.solids.pieces import convex_polygons
from mskgrasp.parts.solids.solid import prism

MOST_PIECES = 600
"""With more, joining them takes longer than another attempt, and leaves too many."""

_ALONG = 0.9995
_ACROSS = 0.03
"""Bounds of the cosine between a face's normal and a direction, for faces across it and along it."""
_LEAST_LEVEL_MM2 = 0.5
"""Smaller faces across the direction (parts of roundings) make no level."""
_LEAST_LAYER_MM = 0.05
_LEAST_AREA_MM2 = 0.02
_LEAST_WIDTH_MM = 0.01
"""Narrower polygons are remainders between two cuts, and flat to a convex hull."""
_MOST_SECTIONS = 400
_LARGE_FACES = 3
"""Largest faces whose normals are directions to cut across, beside the axes."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances of layers, millimetres.

    Attributes:
        sections: Sections of one layer differ by strips no wider than this.
        outline: Detail of outlines that is left out.
        thickness: Layers are not cut more thinly.
        holes: Radius up to which holes are filled.
    """

    sections: float
    outline: float
    thickness: float
    holes: float


def layer_directions(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    """Directions (3,) to cut layers across: the axes, and normals of large faces in other directions.

    Those with the largest share of the surface along or across them come first.
    """
    normals, areas = mesh.face_normals, mesh.area_faces
    found = list(np.eye(3))
    left = areas.copy()
    for _ in range(_LARGE_FACES):
        normal = normals[int(left.argmax())]
        left = np.where(np.abs(normals @ normal) > _ALONG, 0.0, left)
        if all(abs(normal @ other) < 1 - 1e-4 for other in found):
            found.append(normal)
    cosines = [np.abs(normals @ direction) for direction in found]
    shares = np.array([areas[(c > _ALONG) | (c < _ACROSS)].sum() for c in cosines]) / areas.sum()
    return [found[i] for i in np.argsort(-shares, kind="stable")]


@dataclass(frozen=True, kw_only=True)
class Layer:
    """A slice of a body.

    Attributes:
        low: Height of its lower face, mm.
        high: Height of its upper face, mm.
        section: Polygons (shapely), mm.
    """

    low: float
    high: float
    section: Any


class TurnedMesh:
    """A mesh turned so that a direction is up, and its sections.

    Attributes:
        turn: (3, 3) from the mesh's axes.
        levels: Heights of the faces across the direction, and of both ends, mm.
    """

    def __init__(self, mesh: trimesh.Trimesh, direction: np.ndarray) -> None:
        """Turn a watertight mesh, millimetres, so that a unit vector (3,) is up."""
        self.turn = _turned_to_z(direction)
        vertices = np.asarray(mesh.vertices) @ self.turn.T
        self._body = Manifold(Mesh64(np.array(vertices, np.float64), np.array(mesh.faces, np.uint64)))
        self._sections: dict[float, Any] = {}
        self.levels = _levels(vertices[mesh.faces], mesh.face_normals @ direction, mesh.area_faces)

    def section(self, z: float) -> Any:
        """Polygons (shapely) at a height, mm."""
        if z not in self._sections:
            loops = [shapely.Polygon(loop).buffer(0) for loop in self._body.slice(z).to_polygons()]
            # Even-odd: holes lie within outlines, and islands within holes.
            section = shapely.Polygon()
            for loop in sorted(loops, key=lambda loop: -loop.area):
                section = section.symmetric_difference(loop)
            self._sections[z] = section
        return self._sections[z]


class Layers:
    """A turned mesh cut into layers.

    Attributes:
        count: Approximate number of convex pieces.
    """

    def __init__(self, mesh: TurnedMesh, tolerances: Tolerances) -> None:
        """Cut a mesh within tolerances of the layers."""
        self._mesh = mesh
        self._layers = [
            replace(layer, section=_simplified(layer.section, tolerances)) for layer in self._cut(tolerances)
        ]
        self.count = float(sum(_count(layer.section) for layer in self._layers) or np.inf)

    def pieces(self) -> list[np.ndarray] | None:
        """Corners (n, 3) of the convex pieces in the mesh's axes, mm; None where there are too many."""
        found: list[np.ndarray] = []
        if self.count > 2 * MOST_PIECES:
            return None
        for layer in self._layers:
            for part in _polygons(layer.section):
                if part.area >= _LEAST_AREA_MM2:
                    found += [
                        prism(corners, layer.low, layer.high) @ self._mesh.turn
                        for corners in convex_polygons(part)
                        if _width(corners) > _LEAST_WIDTH_MM
                    ]
        return found if 0 < len(found) <= MOST_PIECES else None

    def _cut(self, tolerances: Tolerances) -> list[Layer]:
        """Layers within the tolerances; none where too many sections would be needed."""
        found: list[Layer] = []
        used: set[float] = set()
        levels = self._mesh.levels
        pending = list(zip(levels[:-1], levels[1:], strict=True))[::-1]
        while pending:
            if len(used) > _MOST_SECTIONS:
                return []
            low, high = pending.pop()
            margin, middle = min(0.02, 0.1 * (high - low)), (low + high) / 2
            heights = low + margin, middle, high - margin
            used.update(heights)
            first, section, last = map(self._mesh.section, heights)
            thin = high - low <= tolerances.thickness
            width = tolerances.sections
            if not thin and not (_alike(first, section, width) and _alike(section, last, width)):
                pending += [(middle, high), (low, middle)]
            elif found and found[-1].high == low and _alike(found[-1].section, section, width / 2):
                found[-1] = replace(found[-1], high=high)
            else:
                found.append(Layer(low=low, high=high, section=section))
        return found


def _levels(triangles: np.ndarray, cosines: np.ndarray, areas: np.ndarray) -> list[float]:
    """Heights of the faces across z, and of both ends."""
    flat = np.abs(cosines) > _ALONG
    heights, weights = triangles[flat].mean(axis=1)[:, 2], areas[flat]
    order = np.argsort(heights)
    heights, weights = heights[order], weights[order]
    low, high = float(triangles[..., 2].min()), float(triangles[..., 2].max())
    found = [low]
    for group in np.split(np.arange(len(heights)), np.flatnonzero(np.diff(heights) > 0.02) + 1):
        if weights[group].sum() > _LEAST_LEVEL_MM2:
            height = float(np.average(heights[group], weights=weights[group]))
            if found[-1] + _LEAST_LAYER_MM < height < high - _LEAST_LAYER_MM:
                found.append(height)
    return [*found, high]


def _count(section: Any) -> int:
    """Approximate number of convex polygons: one more for each corner that bends inwards."""
    count = 0
    for part in _polygons(shapely.orient_polygons(section)):
        count += 1
        for ring in (part.exterior, *part.interiors):
            corners = np.asarray(ring.coords)[:-1]
            before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
            # Oriented so that the material is to the left.
            count += int((before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]).sum())
    return count


def _alike(a: Any, b: Any, width: float) -> bool:
    """Whether two regions differ by strips no wider than this."""
    difference = a.symmetric_difference(b)
    return difference.is_empty or difference.buffer(-width / 2, quad_segs=2).is_empty


def _simplified(region: Any, tolerances: Tolerances) -> Any:
    """A region without fine detail and small holes."""
    least = np.pi * tolerances.holes**2
    parts = [
        shapely.Polygon(part.exterior, [ring for ring in part.interiors if _area(ring) > least])
        for part in _polygons(region)
    ]
    return shapely.union_all([part.simplify(tolerances.outline).buffer(0) for part in parts])


def _polygons(region: Any) -> list[Any]:
    """The polygons of a region; a difference may leave lines and points where outlines touch."""
    return [part for part in shapely.get_parts(region) if part.geom_type == "Polygon" and not part.is_empty]


def _width(corners: np.ndarray) -> float:
    """Area of a polygon (n, 2) by its length."""
    return float(shapely.Polygon(corners).area / np.linalg.norm(np.ptp(corners, axis=0)))


def _area(ring: Any) -> float:
    return shapely.Polygon(ring).area


def _turned_to_z(direction: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) that turns a unit vector to +z; for an axis a permutation, free of rounding."""
    least = np.eye(3)[int(np.abs(direction).argmin())]
    first = np.cross(least, direction)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first), direction])
