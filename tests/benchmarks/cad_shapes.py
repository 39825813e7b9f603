"""Shapes that few convex hulls represent badly: springs, heat sinks, grilles, thin shells; millimetres."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from manifold3d import CrossSection, FillRule, Manifold

from mskgrasp.parts.solids import solid as s


def mesh_of(make: Callable[[], Manifold]) -> trimesh.Trimesh:
    """The mesh of a shape."""
    data = make().to_mesh()
    return trimesh.Trimesh(np.asarray(data.vert_properties)[:, :3], np.asarray(data.tri_verts))


def _spring(radius: float = 12, wire: float = 1.5, turns: float = 5, pitch: float = 7) -> Manifold:
    sides, steps = 12, int(turns * 32)
    ring = s.polygon(wire, sides)
    angle = 2 * np.pi * turns * np.arange(steps + 1) / steps
    points = np.stack(
        [
            np.column_stack(
                [
                    (radius + ring[:, 0]) * np.cos(a),
                    (radius + ring[:, 0]) * np.sin(a),
                    ring[:, 1] + pitch * a / 2 / np.pi,
                ]
            )
            for a in angle
        ]
    )
    # Overlapping hulls of neighbouring rings are a closed body without folds.
    hulls = [Manifold.hull_points(points[k : k + 2].reshape(-1, 3)) for k in range(steps)]
    return sum(hulls[1:], hulls[0])


def _heat_sink() -> Manifold:
    body = s.extrude(s.rectangle(0, 40, 0, 40), 0, 3)
    for x in np.arange(0, 39, 3.2):
        body += s.extrude(s.rectangle(x, x + 1.2, 0, 40), 2.9, 15)
    return body


def _pin_sink() -> Manifold:
    body = s.extrude(s.rectangle(0, 30, 0, 30), 0, 3)
    for x in np.arange(1, 30, 4.6):
        for y in np.arange(1, 30, 4.6):
            body += s.extrude(s.rectangle(x, x + 2, y, y + 2), 2.9, 14)
    return body


def _fan_grille() -> Manifold:
    rings = [s.extrude(s.circle(r + 1), 0, 2, [s.circle(r - 1)]) for r in (8, 16, 24, 32)]
    spokes = [s.extrude(s.rectangle(0, 33, -1.2, 1.2), 0, 2.5).rotate((0, 0, 45 + 90 * k)) for k in range(4)]
    return sum((*rings[1:], *spokes), rings[0])


def _cable_clip() -> Manifold:
    ring = s.extrude(s.circle(7), 0, 10, [s.circle(5)]) - s.extrude(s.rectangle(-3, 3, 2, 10), -1, 11)
    foot = s.extrude(s.rectangle(-15, 15, -9, -6.5), 0, 10)
    return ring + foot - s.drill(2.2, (-11, -12, 5), "y", 8) - s.drill(2.2, (11, -12, 5), "y", 8)


def _thin_box(wall: float = 0.8) -> Manifold:
    return s.extrude(s.rectangle(0, 60, 0, 40), 0, 25) - s.extrude(
        s.rectangle(wall, 60 - wall, wall, 40 - wall), wall, 26
    )


def _thin_dome() -> Manifold:
    return Manifold.sphere(25, 64).trim_by_plane((0, 0, 1), 0) - Manifold.sphere(23.8, 64)


def _ribbed_housing() -> Manifold:
    body = _thin_box(2.0)
    for x in np.arange(8, 56, 8):
        body += s.extrude(s.rectangle(x, x + 1.2, 1, 39), 1, 12)
    for x, y in ((5, 5), (55, 5), (5, 35), (55, 35)):
        body += s.extrude(s.circle(3.5) + [x, y], 1, 22) - s.extrude(s.circle(1.3) + [x, y], 4, 23)
    for z in (8, 12, 16):
        body -= s.extrude(s.rectangle(15, 45, -1, 3), z, z + 2)
    return body


def _servo_horn() -> Manifold:
    arm = Manifold.batch_hull([s.extrude(s.circle(4), 0, 2), s.extrude(s.circle(2.5) + [18, 0], 0, 2)])
    star = sum((arm.rotate((0, 0, 90 * k)) for k in range(1, 4)), arm) + s.extrude(s.circle(4.5), 0, 5)
    for turn in range(4):
        for x in (9, 12, 15, 18):
            star -= s.extrude(s.circle(0.6) + [x, 0], -1, 6).rotate((0, 0, 90 * turn))
    return star - s.extrude(s.polygon(2.9, 25), 1.5, 6)


def _impeller() -> Manifold:
    blade = CrossSection([s.rectangle(4, 22, -0.7, 0.7)], FillRule.EvenOdd).extrude(14, 20, 40)
    return sum((blade.rotate((0, 0, 60 * k)) for k in range(6)), s.extrude(s.circle(6), 0, 14))


def _knurled_knob() -> Manifold:
    body = s.lathe([(0, 0), (16, 0), (16, 10), (12, 14), (0, 14)])
    for k in range(24):
        body -= s.extrude(s.polygon(1.5, 16) + [16.5, 0], -1, 11).rotate((0, 0, 15 * k))
    return body - s.extrude(s.circle(3), -1, 9)


def _turned_shaft() -> Manifold:
    return s.lathe(
        [(0, 0), (6, 0), (6, 12), (5, 13), (9, 15), (9, 30), (7, 32), (7, 50), (3, 52), (3, 60), (0, 60)]
    )


def _bent_tube() -> Manifold:
    return CrossSection([s.circle(6) + [30, 0], s.circle(4.5) + [30, 0]], FillRule.EvenOdd).revolve(96, 120)


def _tilted_bracket() -> Manifold:
    return (
        s.extrude(np.array([[0, 0], [50, 0], [50, 6], [6, 6], [6, 35], [0, 35]], dtype=float), 0, 25)
        - s.drill(3, (30, -1, 12), "y", 10)
    ).rotate((25, 40, 10))


def _honeycomb() -> Manifold:
    body = s.extrude(s.rectangle(0, 60, 0, 50), 0, 6)
    for row in range(5):
        for column in range(6):
            centre = [5 + 10 * column + 5 * (row % 2), 6 + 9.5 * row]
            body -= s.extrude(s.polygon(4.6, 6, np.pi / 6) + centre, -1, 7)
    return body


DRAWN: dict[str, Callable[[], Manifold]] = {
    "spring": _spring,
    "heat_sink": _heat_sink,
    "pin_heat_sink": _pin_sink,
    "fan_grille": _fan_grille,
    "cable_clip": _cable_clip,
    "thin_box": _thin_box,
    "thin_dome": _thin_dome,
    "ribbed_housing": _ribbed_housing,
    "servo_horn": _servo_horn,
    "impeller": _impeller,
    "knurled_knob": _knurled_knob,
    "turned_shaft": _turned_shaft,
    "bent_tube": _bent_tube,
    "tilted_bracket": _tilted_bracket,
    "honeycomb": _honeycomb,
}
