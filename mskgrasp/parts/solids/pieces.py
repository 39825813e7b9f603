"""Exact convex decomposition of plane outlines, of turned profiles, and of one body cut by another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from manifold3d import Manifold
from scipy.spatial import ConvexHull

from mskgrasp.parts.solids import solid as s

_MOST_CORNERS = s.MAX_HULL_VERTICES // 2
_MOST_PROFILE_CORNERS = 10
_TOUCH = 1e-6


def convex_polygons(region: Any, most_corners: int = _MOST_CORNERS) -> list[np.ndarray]:
    """A partition of a plane region into few convex polygons (n, 2).

    Triangles of the constrained Delaunay triangulation are joined again wherever the result is convex, the
    largest first (Hertel and Mehlhorn, 1983, allow at most four times the least number).

    Args:
        region: A polygon, or several, with or without holes.
        most_corners: Greatest number of one piece; 16 give a prism of 32 corners.
    """
    triangles = [
        np.asarray(shapely.get_coordinates(triangle))[:-1]
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(region))
        if triangle.area > 1e-9
    ]
    pieces: dict[int, np.ndarray] = {n: _counter_clockwise(t) for n, t in enumerate(triangles)}
    corners = {n: {tuple(corner) for corner in np.round(t, 7)} for n, t in pieces.items()}
    sides: dict[int, list[int]] = {
        n: [m for m, others in corners.items() if m != n and len(own & others) == 2]
        for n, own in corners.items()
    }
    # Unions of pairs that no later union has changed are not computed again.
    known: dict[tuple[int, int], tuple[float, np.ndarray] | None] = {}
    while True:
        best: tuple[float, int, int, np.ndarray] | None = None
        for a, others in sides.items():
            for b in others:
                if a < b:
                    if (a, b) not in known:
                        joined = _joined(pieces[a], pieces[b], most_corners)
                        known[a, b] = None if joined is None else (_area(joined), joined)
                    found = known[a, b]
                    if found is not None and (best is None or found[0] > best[0] + 1e-9):
                        best = (found[0], a, b, found[1])
        if best is None:
            return list(pieces.values())
        _, a, b, joined = best
        known = {pair: found for pair, found in known.items() if not {a, b} & set(pair)}
        del pieces[b]
        pieces[a] = joined
        for n in sides.pop(b):
            sides[n] = [a if m == b else m for m in sides[n]]
            sides[a].append(n)
        for n in sides:
            sides[n] = sorted({m for m in sides[n] if m != n})


def turned_pieces(profile: Sequence[tuple[float, float]], detail_mm: float) -> list[np.ndarray]:
    """Convex pieces of a body of revolution about z.

    The region that reaches the axis becomes frusta; the rest becomes wedges about the axis.

    Args:
        profile: (radius, z) corners of the half section in order.
        detail_mm: Finer detail of the profile is left out.
    """
    section = shapely.Polygon(profile).simplify(detail_mm).buffer(0)
    solid_part, frusta = _frusta(section)
    pieces = frusta
    rest = section.difference(solid_part) if solid_part is not None else section
    for polygon in _nested_rings(rest):
        pieces += _wedges(polygon, section)
    return pieces


def split_by(points: np.ndarray, cutter: np.ndarray) -> list[np.ndarray]:
    """The convex pieces that are left when one convex body is cut out of another."""
    low, high = points.min(axis=0), points.max(axis=0)
    if (cutter.min(axis=0) > high).any() or (cutter.max(axis=0) < low).any():
        return [points]
    body = Manifold.hull_points(np.asarray(points, dtype=np.float64))
    common = body ^ Manifold.hull_points(np.asarray(cutter, dtype=np.float64))
    if common.is_empty() or common.volume() < 1e-6 * body.volume():
        return [points]
    left = []
    for normal, offset in _faces(cutter):
        outside = body.trim_by_plane(tuple(normal), offset)
        if not outside.is_empty() and outside.volume() > 1e-4:
            left.append(_points(outside))
        body = body.trim_by_plane(tuple(-normal), -offset)
        if body.is_empty():
            break
    return left


def _frusta(section: Any) -> tuple[Any | None, list[np.ndarray]]:
    """The region next to the axis, cut into slabs that reach it, and the frusta they turn into."""
    levels = np.unique(np.round(shapely.get_coordinates(section)[:, 1], 6))
    reach = 1 + shapely.get_coordinates(section)[:, 0].max()
    slabs: list[tuple[float, float, float, float]] = []
    regions = []
    for z0, z1 in zip(levels[:-1], levels[1:], strict=True):
        cut = section.intersection(shapely.box(-1, z0, reach, z1))
        for part in shapely.get_parts(cut):
            corners = np.asarray(shapely.get_coordinates(part))
            if part.area < 1e-9 or corners[:, 0].min() > _TOUCH:
                continue
            low, high = (corners[np.abs(corners[:, 1] - z) < 1e-5, 0] for z in (z0, z1))
            if len(low) and len(high) and low.min() < _TOUCH and high.min() < _TOUCH:
                slabs.append((z0, float(low.max()), z1, float(high.max())))
                regions.append(part)
    if not slabs:
        return None, []
    pieces = []
    for group in _convex_runs(slabs):
        pieces += _round_body(group)
    return shapely.union_all(regions), pieces


def _convex_runs(slabs: list[tuple[float, float, float, float]]) -> list[list[tuple[float, float]]]:
    """Run of (z, radius) along the axis that turn into convex bodies."""
    runs: list[list[tuple[float, float]]] = []
    for z0, r0, z1, r1 in slabs:
        if runs and abs(runs[-1][-1][0] - z0) < 1e-5 and abs(runs[-1][-1][1] - r0) < 1e-5:
            (za, ra), (zb, rb) = runs[-1][-2:]
            bends_inward = (r1 - rb) / (z1 - zb) <= (rb - ra) / (zb - za) + 1e-9
            if bends_inward and len(runs[-1]) < 4:
                runs[-1].append((z1, r1))
                continue
        runs.append([(z0, r0), (z1, r1)])
    return runs


def _nested_rings(region: Any) -> list[np.ndarray]:
    """Convex pieces of a half section away from the axis: the tube through all of it, then the rest.

    Cut along cylinders, a flange needs only wedges whose inner chords are hidden in the tube.
    """
    found = []
    for part in shapely.get_parts(region):
        if part.area < 1e-6:
            continue
        corners = np.asarray(shapely.get_coordinates(part.simplify(1e-6)))[:-1]
        core = _core_radius(part)
        if part.convex_hull.area < part.area + 1e-6 and len(corners) <= _MOST_PROFILE_CORNERS:
            found.append(_counter_clockwise(corners))
        elif corners[:, 0].min() + 0.2 < core < corners[:, 0].max() - 1e-3:
            _, z0, reach, z1 = part.bounds
            inside = shapely.box(-1, z0 - 1, core, z1 + 1)
            outside = shapely.box(core, z0 - 1, reach + 1, z1 + 1)
            found += _nested_rings(part.intersection(inside)) + _nested_rings(part.intersection(outside))
        else:
            found += convex_polygons(part, _MOST_PROFILE_CORNERS)
    return found


def _core_radius(part: Any) -> float:
    """Least outer radius of the material that is next to the axis, over the whole height."""
    _, z0, reach, z1 = part.bounds
    levels = np.unique(np.round(shapely.get_coordinates(part)[:, 1], 6))
    step = 1e-3 * (z1 - z0)
    least = reach
    for z in np.concatenate([levels[:-1] + step, levels[1:] - step]):
        line = part.intersection(shapely.LineString([(-1, z), (reach + 1, z)]))
        first = min(
            (
                np.asarray(shapely.get_coordinates(piece))[:, 0]
                for piece in shapely.get_parts(line)
                if not piece.is_empty
            ),
            key=lambda radius: radius.min(),
            default=np.array([reach]),
        )
        least = min(least, float(first.max()))
    return least


def _round_body(run: list[tuple[float, float]]) -> list[np.ndarray]:
    """Hulls of one convex turned body: one, or as many sectors as its corners need."""
    radius = max(r for _, r in run)
    sides = s.sides_for(radius, s.ROUND_TOLERANCE_MM, 4, 12, 28)
    for sectors in (1, 2, 4, 7):
        if sides % sectors:
            continue
        per_sector = sides // sectors + (sectors > 1)
        if per_sector * len(run) + 2 * (sectors > 2) <= s.MAX_HULL_VERTICES:
            break
    hulls = []
    for sector in range(sectors):
        steps = sides // sectors
        angles = 2 * np.pi * (sector * steps + np.arange(steps + (sectors > 1))) / sides
        swell = 2 / (1 + np.cos(np.pi / sides))
        points = [
            np.column_stack([r * swell * np.cos(angles), r * swell * np.sin(angles), np.full(len(angles), z)])
            for z, r in run
        ]
        if sectors > 2:
            points.append(np.array([[0, 0, run[0][0]], [0, 0, run[-1][0]]]))
        hulls.append(_corners(np.concatenate(points)))
    return hulls


def _wedges(polygon: np.ndarray, section: Any) -> list[np.ndarray]:
    """A convex piece of the half section, turned about the axis in sectors that are convex enough."""
    inner = _inner_corners(polygon)
    bore = _bore_radius(polygon, inner, section)
    outer_radius = float(polygon[:, 0].max())
    sectors = s.sides_for(bore, s.BORE_TOLERANCE_MM, 2, 8, 16) if bore else _hidden_sectors(polygon, section)
    least_sides = s.sides_for(outer_radius, s.ROUND_TOLERANCE_MM, 4, 24, 48)
    while True:
        steps = max(1, -(-least_sides // sectors))
        corners = 2 * int(inner.sum()) + (steps + 1) * int((~inner).sum())
        if corners <= s.MAX_HULL_VERTICES or steps == 1:
            break
        if sectors < 8 or steps > 3:
            sectors += 2
        else:
            least_sides = sectors * (steps - 1)
    swell_out = 2 / (1 + np.cos(np.pi / (sectors * steps)))
    swell_in = 2 / (1 + np.cos(np.pi / sectors)) if bore else 1.0
    hulls = []
    for sector in range(sectors):
        angles = 2 * np.pi * (sector + np.arange(steps + 1) / steps) / sectors
        points = [_around(polygon[~inner] * [swell_out, 1], angle) for angle in angles]
        points += [_around(polygon[inner] * [swell_in, 1], angle) for angle in (angles[0], angles[-1])]
        hulls.append(_corners(np.concatenate(points)))
    return hulls


def _hidden_sectors(polygon: np.ndarray, section: Any) -> int:
    """Fewest sectors whose inner chords stay within the body further in."""
    free = 0.0
    start = float(polygon[:, 0].min())
    for z in np.linspace(polygon[:, 1].min(), polygon[:, 1].max(), 7)[1:-1]:
        gap = shapely.LineString([(0, z), (start, z)]).difference(section.buffer(1e-6))
        if not gap.is_empty:
            free = max(free, float(shapely.get_coordinates(gap)[:, 0].max()))
    return next((n for n in (4, 6, 8, 10, 12) if start * np.cos(np.pi / n) >= free), 16)


def _inner_corners(polygon: np.ndarray) -> np.ndarray:
    """(n,) bool: whether each corner of a convex half section faces the axis."""
    shape = shapely.Polygon(polygon)
    inner = []
    for r, z in polygon:
        line = shapely.LineString([(-1, z), (polygon[:, 0].max() + 1, z)])
        across = shapely.get_coordinates(shape.intersection(line))
        inner.append(bool(len(across) and across[:, 0].max() > r + 1e-6))
    return np.array(inner)


def _bore_radius(polygon: np.ndarray, inner: np.ndarray, section: Any) -> float:
    """Largest radius of those edges towards the axis that are surface, not a joint; 0 without any."""
    found = 0.0
    for number in range(len(polygon)):
        a, b = polygon[number], polygon[(number + 1) % len(polygon)]
        if not (inner[number] or inner[(number + 1) % len(polygon)]) or abs(a[1] - b[1]) < 1e-6:
            continue
        middle = (a + b) / 2
        if middle[0] > 1e-3 and not section.contains(shapely.Point(middle[0] - 1e-3, middle[1])):
            found = max(found, float(a[0]), float(b[0]))
    return found


def _around(section: np.ndarray, angle: float) -> np.ndarray:
    return np.column_stack([section[:, 0] * np.cos(angle), section[:, 0] * np.sin(angle), section[:, 1]])


def _corners(points: np.ndarray) -> np.ndarray:
    """The points that are corners of their convex hull."""
    return points[np.sort(ConvexHull(points).vertices)]


def _points(body: Manifold) -> np.ndarray:
    return np.asarray(body.to_mesh64().vert_properties)[:, :3]


def _faces(points: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Outward planes (normal, offset) of a convex body, one for each flat side, the largest side first."""
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    planes: dict[tuple[float, ...], tuple[float, np.ndarray]] = {}
    for plane, area in zip(hull.equations, areas, strict=True):
        key = tuple(np.round(plane, 5) + 0.0)
        planes[key] = (planes.get(key, (0.0, plane))[0] + float(area), plane)
    ordered = sorted(planes.items(), key=lambda item: (-item[1][0], item[0]))
    return [(plane[:3], -float(plane[3])) for _, (_, plane) in ordered]


def _counter_clockwise(polygon: np.ndarray) -> np.ndarray:
    return polygon if _signed_area(polygon) > 0 else polygon[::-1]


def _signed_area(polygon: np.ndarray) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    # np.roll takes ten times as long.
    next_x, next_y = np.append(x[1:], x[:1]), np.append(y[1:], y[:1])
    return float((x * next_y - next_x * y).sum() / 2)


def _area(polygon: np.ndarray) -> float:
    return abs(_signed_area(polygon))


def _joined(a: np.ndarray, b: np.ndarray, most_corners: int) -> np.ndarray | None:
    """The union of two convex polygons that share an edge, if it is convex."""
    hull: Any = shapely.convex_hull(shapely.multipoints(np.concatenate([a, b])))
    if hull.area > _area(a) + _area(b) + 1e-6 * hull.area:
        return None
    corners = np.asarray(shapely.get_coordinates(hull.simplify(1e-6)))[:-1]
    return _counter_clockwise(corners) if len(corners) <= most_corners else None
