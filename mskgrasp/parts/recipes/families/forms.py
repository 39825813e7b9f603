"""Shared shapes of fasteners, eyes and grips: bent rods, rings, knurls, hexagons, lobes; millimetres."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import shapely
from manifold3d import CrossSection, FillRule, Manifold, Mesh64

from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.pieces import convex_polygons

BEND_TOLERANCE_MM = 0.3
"""Largest distance of a bend's hulls from its true arc, to either side."""

_ROD_SEGMENTS = 64
_FINE_STEP = np.radians(4)

Step = float | tuple[float, float]
Station = tuple[np.ndarray, float]


def arc(radius: float, z: float, start: float, end: float, count: int = 24) -> list[tuple[float, float]]:
    """Points of a half profile on a circle about (0, z), from one angle to another in degrees."""
    angles = np.radians(np.linspace(start, end, count))
    points = np.stack([radius * np.cos(angles), z + radius * np.sin(angles)], axis=1)
    # A rounding error off the axis would open a needle-thin bore.
    points[np.abs(points[:, 0]) < 1e-9, 0] = 0.0
    return [(float(a), float(b)) for a, b in points]


def hex_ring(across_flats: float, bore_radius: float, z0: float, z1: float) -> h.Shape:
    """A hexagonal prism about z with a round bore."""
    hexagon = s.hexagon(across_flats)
    hole = s.bore_polygon(bore_radius, multiple=6)
    body = s.extrude(hexagon, z0, z1, [s.circle(bore_radius)])
    return h.tool(body, s.around_hole(hexagon, hole, z0, z1))


def socket_head(diameter: float, height: float, across_flats: float, depth: float) -> h.Shape:
    """A cylinder below z = 0 with a hexagon socket in its lower face."""
    radius, socket = diameter / 2, s.hexagon(across_flats)
    body = s.extrude(s.circle(radius), -height, 0) - s.extrude(socket, -height - 1, -height + depth)
    rim = s.around_hole(s.round_outline(radius, 6), socket, -height, -height + depth)
    return h.tool(body, [*rim, *s.rod(radius, -height + depth, 0, multiple=6)])


def shank(diameter: float, z0: float, z1: float) -> h.Shape:
    """A threaded rod with its upper end chamfered to about the thread's root."""
    r, chamfer = diameter / 2, 0.1 * diameter
    return h.turned([(0, z0), (r, z0), (r, z1 - chamfer), (r - chamfer, z1), (0, z1)])


def knurled(radius: float, z0: float, z1: float, depth: float = 0.6, edge: float = 0.8) -> h.Shape:
    """A disc with straight V-shaped knurls, both edges chamfered; hulls smooth the knurls."""
    count = int(round(2 * np.pi * radius / (2.5 * depth)))
    angle = np.pi * np.arange(2 * count) / count
    reach = np.where(np.arange(2 * count) % 2 == 0, radius, radius - depth)
    teeth = s.extrude(np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1), z0, z1)
    rim = [
        (0.0, z0),
        (radius - edge, z0),
        (radius, z0 + edge),
        (radius, z1 - edge),
        (radius - edge, z1),
        (0.0, z1),
    ]
    smooth = h.cylinder(radius - depth / 2, z0, z1)
    return h.tool(teeth ^ s.lathe(rim), smooth.hulls)


def torus(ring_radius: float, rod_radius: float) -> h.Shape:
    """A ring about z of round section."""
    section = [(ring_radius + x, z) for x, z in s.polygon(rod_radius, _ROD_SEGMENTS)]
    count = int(np.ceil(2 * np.pi / _coarse_step(ring_radius + rod_radius)))
    centre_radius = 2 * ring_radius / (1 + np.cos(np.pi / count))
    rings = [
        _ring(centre_radius * np.array([np.cos(a), np.sin(a)]), a + np.pi / 2, _hull_section(rod_radius))
        for a in 2 * np.pi * np.arange(count) / count
    ]
    hulls = [np.concatenate([a, b]) for a, b in zip(rings, [*rings[1:], rings[0]], strict=True)]
    return h.tool(s.lathe(section), hulls)


def bent_rod(radius: float, *steps: Step, end_radius: float | None = None, chamfer: float = 0.0) -> h.Shape:
    """A round rod in the xy-plane from the origin, along +x at first.

    Args:
        radius: Radius of the rod.
        steps: Straight lengths, and bends as (radius of the centre line, degrees); a bend to the left is
            positive.
        end_radius: Radius of the rod's far end, if it tapers.
        chamfer: Chamfer of both ends.
    """
    taper = radius if end_radius is None else end_radius
    fine = _stations(steps, lambda bend: _FINE_STEP, balanced=False)
    coarse = _stations(steps, lambda bend: _coarse_step(bend + radius), balanced=True)
    circle = s.polygon(1.0, _ROD_SEGMENTS)
    body = _skin([_ring(xy, a, r * circle) for xy, a, r in _radii(fine, radius, taper, chamfer)])
    section = _hull_section(1.0, sides=8 if radius < 3 else 10 if radius < 6 else 12)
    rings = [_ring(xy, a, r * section) for xy, a, r in _radii(coarse, radius, taper, chamfer)]
    return h.tool(body, [np.concatenate(pair) for pair in zip(rings[:-1], rings[1:], strict=True)])


def lobes(radius: float, count: int, depth: float) -> np.ndarray:
    """The outline of a grip with round lobes, the first towards +x."""
    angle = 2 * np.pi * np.arange(24 * count) / (24 * count)
    reach = radius - depth * (1 - np.cos(count * angle)) / 2
    return np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1)


def tapered(outline: np.ndarray, *levels: tuple[float, float]) -> h.Shape:
    """A body about z whose sections are one outline in several sizes.

    Args:
        outline: (n, 2) corners in order; convex or not.
        levels: (z, scale) from below to above.
    """
    section = CrossSection([np.asarray(outline, dtype=np.float64)], FillRule.EvenOdd)
    region = shapely.Polygon(outline).simplify(2 * h.HULL_DETAIL_MM)
    pieces = convex_polygons(region, most_corners=16)
    body, hulls = Manifold(), []
    for (z0, scale0), (z1, scale1) in zip(levels[:-1], levels[1:], strict=True):
        top = (scale1 / scale0, scale1 / scale0)
        body += section.scale((scale0, scale0)).extrude(z1 - z0, scale_top=top).translate((0.0, 0.0, z0))
        for piece in pieces:
            ends = [
                np.column_stack([k * piece, np.full(len(piece), z)]) for z, k in ((z0, scale0), (z1, scale1))
            ]
            hulls.append(np.concatenate(ends))
    return h.tool(body, hulls)


def arm(z0: float, z1: float, *discs: tuple[float, float, float]) -> h.Shape:
    """A flat bar from disc (x, y, radius) to disc; each stretch between two of them is one hull."""
    shape = h.tool(Manifold())
    for a, b in zip(discs[:-1], discs[1:], strict=True):
        exact = shapely.union_all([shapely.Polygon(s.circle(r, (x, y))) for x, y, r in (a, b)]).convex_hull
        coarse = [s.balanced_polygon(r, 12, np.pi / 12, centre=(x, y)) for x, y, r in (a, b)]
        corners = np.asarray(shapely.get_coordinates(shapely.MultiPoint(np.concatenate(coarse)).convex_hull))[
            :-1
        ]
        outline = np.asarray(shapely.get_coordinates(exact))[:-1][::-1]
        shape += h.tool(s.extrude(outline, z0, z1), [s.prism(corners, z0, z1)])
    return shape


def _coarse_step(outer_radius: float) -> float:
    """Largest angle of a chord that stays within the tolerance of a bend's outer side."""
    share = BEND_TOLERANCE_MM / outer_radius
    return 2 * float(np.arccos((1 - share) / (1 + share)))


def _hull_section(radius: float, sides: int = 10) -> np.ndarray:
    return s.balanced_polygon(radius, sides, phase=np.pi / sides)


def _ring(centre: np.ndarray, heading: float, section: np.ndarray) -> np.ndarray:
    """A section (n, 2), across the path and along z, placed on a path in the xy-plane."""
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    return np.array([*centre, 0.0]) + section[:, :1] * across + section[:, 1:] * np.array([0.0, 0.0, 1.0])


def _stations(steps: Sequence[Step], step_for: Callable[[float], float], *, balanced: bool) -> list[Station]:
    """Points of the centre line with the heading there, the ends of each step among them."""
    here, heading = np.zeros(2), 0.0
    found = [(here, heading)]
    for step in steps:
        if not isinstance(step, tuple):
            here = here + float(step) * np.array([np.cos(heading), np.sin(heading)])
            found.append((here, heading))
            continue
        bend, turn = step[0], np.radians(step[1])
        side = np.sign(turn)
        centre = here + side * bend * np.array([-np.sin(heading), np.cos(heading)])
        count = int(np.ceil(abs(turn) / step_for(bend)))
        swell = 2 / (1 + np.cos(turn / count / 2)) if balanced else 1.0
        for n in range(1, count + 1):
            angle = heading + turn * n / count
            reach = bend * (swell if n < count else 1.0)
            found.append((centre + side * reach * np.array([np.sin(angle), -np.cos(angle)]), angle))
        here, heading = found[-1]
    return found


def _radii(
    stations: Sequence[Station], radius: float, end_radius: float, chamfer: float
) -> list[tuple[np.ndarray, float, float]]:
    """Stations with the rod's radius there, and one more at each end for the chamfer."""
    points = np.array([xy for xy, _ in stations])
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    radii = radius + (end_radius - radius) * run / run[-1]
    found = [(xy, a, float(r)) for (xy, a), r in zip(stations, radii, strict=True)]
    if chamfer:
        (first, a0, r0), (last, a1, r1) = found[0], found[-1]
        inward = chamfer * np.array([[np.cos(a0), np.sin(a0)], [-np.cos(a1), -np.sin(a1)]])
        ends = [(first, a0, r0 - chamfer), (first + inward[0], a0, r0)]
        found = [*ends, *found[1:-1], (last + inward[1], a1, r1), (last, a1, r1 - chamfer)]
    return found


def _skin(rings: Sequence[np.ndarray]) -> Manifold:
    """The closed surface through equal rings, with flat ends."""
    n, m = len(rings[0]), len(rings)
    a = np.arange(n)
    b = (a + 1) % n
    faces = []
    for k in range(m - 1):
        low, high = k * n, (k + 1) * n
        faces += [np.stack([low + a, high + a, low + b], 1), np.stack([low + b, high + a, high + b], 1)]
    for k, order in ((0, (0, 1, 2)), (m - 1, (0, 2, 1))):
        fan = np.stack([np.zeros(n - 2, int), a[1:-1], a[2:]], 1)[:, order]
        faces.append(fan + k * n)
    points = np.concatenate(rings)
    triangles = np.concatenate(faces)
    corners = points[triangles]
    if np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() < 0:
        triangles = triangles[:, ::-1]
    return Manifold(Mesh64(points.astype(np.float64), triangles.astype(np.uint64)))
