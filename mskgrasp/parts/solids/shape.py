"""Constructive shapes: a body with the convex pieces that represent it, in millimetres.

Families compose a part from a few of these. Adding, cutting, moving and turning apply to body and hulls,
so that a family does not have to describe its collision geometry.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

import numpy as np
import shapely
from manifold3d import Manifold, OpType
from scipy.spatial import ConvexHull, QhullError

from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.merging import merge_hulls
from mskgrasp.parts.solids.pieces import convex_polygons, split_by, turned_pieces

HULL_DETAIL_MM = 0.15
"""Size of detail that hulls leave out of an outline or profile: small chamfers, the facets of fillets."""

FILLED_BORE_MM = 2.6
"""Bores up to this radius are filled in the hulls: no finger enters, and each would cost eight pieces."""

_FILLED_OVERRIDE: ContextVar[float] = ContextVar("filled_override", default=FILLED_BORE_MM)

_SLIVER_MM = 0.05
"""Pieces thinner than this are left out: PhysX cannot cook them, and they do not affect contact."""


@contextmanager
def bores_filled_to(radius_mm: float) -> Iterator[None]:
    """Fill bores of plates up to another radius than ``FILLED_BORE_MM`` within the context."""
    token = _FILLED_OVERRIDE.set(radius_mm)
    try:
        yield
    finally:
        _FILLED_OVERRIDE.reset(token)


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A body and its convex pieces, millimetres.

    Attributes:
        body: The exact shape.
        hulls: Corner points (n, 3) of each convex piece.
    """

    body: Manifold
    hulls: tuple[np.ndarray, ...]

    def __add__(self, other: Shape) -> Shape:
        """The union."""
        return Shape(body=self.body + other.body, hulls=(*self.hulls, *other.hulls))

    def __sub__(self, other: Shape) -> Shape:
        """The difference, of the bodies and of the hulls."""
        hulls = self.hulls
        for cutter in other.hulls:
            hulls = tuple(piece for points in hulls for piece in split_by(points, cutter))
        return Shape(body=self.body - other.body, hulls=hulls)

    def drilled(self, *tools: Shape | Manifold) -> Shape:
        """The shape with holes in the body that its hulls leave filled."""
        body = self.body
        for tool in tools:
            body = body - (tool.body if isinstance(tool, Shape) else tool)
        return Shape(body=body, hulls=self.hulls)

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Shape:
        """Shifted."""
        by = np.array([x, y, z], dtype=float)
        return Shape(
            body=self.body.translate((float(x), float(y), float(z))),
            hulls=tuple(points + by for points in self.hulls),
        )

    def turned(self, axis: str, degrees: float) -> Shape:
        """Turned about the x, y or z axis through the origin, counter-clockwise seen from its tip."""
        matrix = _rotation(axis, degrees)
        return Shape(
            body=self.body.transform(np.column_stack([matrix, np.zeros(3)])),
            hulls=tuple(points @ matrix.T for points in self.hulls),
        )

    def mirrored(self, axis: str) -> Shape:
        """Mirrored at the plane through the origin that is normal to an axis."""
        normal = np.eye(3)["xyz".index(axis)]
        flip = 1.0 - 2.0 * normal
        return Shape(
            body=self.body.mirror((float(normal[0]), float(normal[1]), float(normal[2]))),
            hulls=tuple(points * flip for points in self.hulls),
        )

    def solid(self, *, merge: bool = True) -> s.Solid:
        """The solid of a part; pieces that form a convex body together become one."""
        hulls = [points for points in self.hulls if _is_thick(points)]
        if merge:
            hulls = merge_hulls(hulls)
        return s.solid(self.body, hulls)


def plate(
    outline: np.ndarray, z0: float, z1: float, holes: Iterable[tuple[float, float, float]] = ()
) -> Shape:
    """A prism over any simple outline, with round holes.

    Args:
        outline: (n, 2) corners in order; convex or not.
        z0: Lower face.
        z1: Upper face.
        holes: (x, y, radius) of through holes; hulls fill those of a radius up to ``FILLED_BORE_MM``.
    """
    holes = tuple(holes)
    body = s.extrude(outline, z0, z1, [s.circle(r, (x, y)) for x, y, r in holes])
    region = shapely.Polygon(outline).simplify(HULL_DETAIL_MM)
    for x, y, r in holes:
        if r > _FILLED_OVERRIDE.get():
            region = region.difference(shapely.Polygon(s.bore_polygon(r, centre=(x, y))))
    return Shape(body=body, hulls=tuple(s.prism(piece, z0, z1) for piece in convex_polygons(region)))


def block(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Shape:
    """A box."""
    return plate(s.rectangle(x0, x1, y0, y1), z0, z1)


def cylinder(radius: float, z0: float, z1: float) -> Shape:
    """A cylinder about z."""
    return turned([(0.0, z0), (radius, z0), (radius, z1), (0.0, z1)])


def hexagon_bar(across_flats: float, z0: float, z1: float) -> Shape:
    """A hexagonal prism about z with flats facing +y and -y."""
    return plate(s.hexagon(across_flats), z0, z1)


def turned(profile: Sequence[tuple[float, float]]) -> Shape:
    """A body of revolution about z from its half profile, (radius, z) corners in order; bores are kept."""
    return Shape(body=s.lathe(profile), hulls=tuple(turned_pieces(profile, HULL_DETAIL_MM)))


def swept(sections: Sequence[np.ndarray]) -> Shape:
    """A convex cross-section swept along a path: each pair of neighbouring sections spans one piece.

    Args:
        sections: (n, 3) corners of each section, equally many and in the same order. Bends need one section
            for every 15 to 20 degrees.
    """
    pieces = [np.concatenate(pair) for pair in zip(sections[:-1], sections[1:], strict=True)]
    body = Manifold.batch_boolean([Manifold.hull_points(points) for points in pieces], OpType.Add)
    return Shape(body=body, hulls=tuple(pieces))


def tool(body: Manifold, hulls: Iterable[np.ndarray] = ()) -> Shape:
    """A body with given convex pieces."""
    return Shape(body=body, hulls=tuple(np.asarray(points, dtype=float) for points in hulls))


def convex(points: np.ndarray) -> Shape:
    """The convex hull of points (n, 3)."""
    points = np.asarray(points, dtype=float)
    return Shape(body=Manifold.hull_points(points), hulls=(points,))


def _rotation(axis: str, degrees: float) -> np.ndarray:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    if degrees % 90 == 0:
        cos, sin = np.round(cos), np.round(sin)
    return {
        "x": np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]]),
        "y": np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]),
        "z": np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]),
    }[axis]


def _is_thick(points: np.ndarray) -> bool:
    try:
        hull = ConvexHull(points)
    except QhullError:
        return False
    heights = points @ hull.equations[:, :3].T
    return bool((heights.max(axis=0) - heights.min(axis=0)).min() > _SLIVER_MM)
