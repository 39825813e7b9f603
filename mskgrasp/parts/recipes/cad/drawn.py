"""Castings, forgings and mouldings with fillets, lofts and drafts, drawn with build123d; own dimensions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import shapely
import trimesh

from mskgrasp.parts.recipes.cad.brep import lengths, mesh_of, needs_cad, table
from mskgrasp.parts.recipes.cad.hulls import turned_hulls
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.measure import MOST_ASPECT_RATIO, aspect_ratio
from mskgrasp.parts.solids.merging import merge_hulls
from mskgrasp.parts.solids.pieces import split_by, turned_pieces
from mskgrasp.parts.solids.shape import HULL_DETAIL_MM

CAST_IRON = 7200.0
POLYAMIDE = 1140.0

Size = tuple[float, float, float, float, float, float]


def recipes() -> Iterator[Recipe]:
    """One part for each row of the table."""
    for row in table("drawn.csv"):
        density, draw = FAMILIES[row["family"]]
        yield Recipe(
            name=row["name"],
            family=row["family"],
            source="own dimensions, drawn with build123d 0.13",
            density=density,
            dimensions=lengths(row),
            make=_maker(draw, HULLS.get(row["family"])),
        )


def _maker(
    draw: Callable[[Any, Size], Any], pieces: Callable[[trimesh.Trimesh, Size], list[np.ndarray]] | None
) -> Callable[[dict[str, float]], s.Solid]:
    @needs_cad
    def make(size: dict[str, float]) -> s.Solid:
        import build123d

        a, b, c, d, e, f = (size[f"{letter}_mm"] for letter in "abcdef")
        mesh = mesh_of(draw(build123d, (a, b, c, d, e, f)))
        # A mesh without given pieces is decomposed.
        hulls = pieces(mesh, (a, b, c, d, e, f)) if pieces else []
        return s.Solid(mesh=mesh, hulls=tuple(hulls))

    return make


def lever(b: Any, size: Size) -> Any:
    """Two bosses and a web between them that tapers with them."""
    distance, large, small, height, web, bore = size
    plan = b.make_hull(
        [*b.Circle(large * 0.36).edges(), *(b.Pos(distance, 0) * b.Circle(small * 0.36)).edges()]
    )
    body = b.extrude(plan, web / 2, both=True)
    body += b.Cylinder(large / 2, height) + b.Pos(distance, 0) * b.Cylinder(small / 2, height)
    body = b.chamfer(body.edges().group_by(b.Axis.Z)[-1] + body.edges().group_by(b.Axis.Z)[0], 0.8)
    pin = small * 0.25
    return body - b.Cylinder(bore / 2, 2 * height) - b.Pos(distance, 0) * b.Cylinder(pin, 2 * height)


def nozzle(b: Any, size: Size) -> Any:
    """A hollow cone of smooth outline on a collar."""
    length, foot, tip, wall, collar, flange = size
    heights, radii = (0, length * 0.35, length), (foot / 2, foot * 0.45, tip / 2)
    outside = b.loft([b.Plane.XY.offset(z) * b.Circle(r) for z, r in zip(heights, radii, strict=True)])
    inside = b.loft(
        [
            b.Plane.XY.offset(z) * b.Circle(r - wall)
            for z, r in zip((-1, length * 0.35, length + 1), radii, strict=True)
        ]
    )
    ring = b.Pos(0, 0, collar / 2) * b.Cylinder(flange / 2, collar)
    return outside + b.chamfer(ring.edges(), 1.0) - inside


def port_block(b: Any, size: Size) -> Any:
    """A block with a bore along it and cross bores that meet it."""
    length, width, height, bore, cross, edge = size
    body = b.chamfer(b.Box(length, width, height).edges(), edge)
    body -= b.Rot(0, 90, 0) * b.Cylinder(bore / 2, 2 * length)
    for x in (-length / 4, length / 4):
        body -= b.Pos(x, 0, height / 2) * b.Cylinder(cross / 2, height)
    return body


def _block_pieces(_: trimesh.Trimesh, size: Size) -> list[np.ndarray]:
    """Sectors around the long bore, chamfered, with the cross bores cut out of them."""
    length, width, height, bore, cross, edge = size
    outline = s.rectangle(-height / 2, height / 2, -width / 2, width / 2)
    sectors = s.around_hole(outline, s.bore_polygon(bore / 2), -length / 2, length / 2)
    pieces = [points[:, [2, 1, 0]] for points in sectors]
    half = np.array([length, width, height]) / 2
    edges = [np.array(sign) / np.sqrt(2) for sign in product((-1, 0, 1), repeat=3) if sign.count(0) == 1]
    pieces = s.cut(pieces, edges, [np.abs(normal) @ half - edge / np.sqrt(2) for normal in edges])
    for x in (-length / 4, length / 4):
        cutter = s.prism(s.bore_polygon(cross / 2, centre=(x, 0)), 0, height)
        pieces = [rest for points in pieces for rest in split_by(points, cutter)]
    return merge_hulls([points for points in pieces if aspect_ratio(points) <= 0.9 * MOST_ASPECT_RATIO], 0.01)


def cast_angle(b: Any, size: Size) -> Any:
    """An angle with a large inner fillet, rounded ends and a bore in each leg."""
    length, height, width, thick, inner, bore = size
    low = (b.Align.MIN, b.Align.CENTER, b.Align.MIN)
    body = b.Box(length, width, thick, align=low) + b.Box(thick, width, height, align=low)
    corner = body.edges().filter_by(b.Axis.Y).sort_by_distance((thick, 0, thick))[0]
    body = b.fillet(corner, inner)
    ends = body.edges().filter_by(b.Axis.Z).group_by(b.Axis.X)[-1]
    body = b.fillet(ends, width / 5)
    body -= b.Pos((length + thick + inner) / 2, 0, 0) * b.Cylinder(bore / 2, 4 * thick)
    return body - b.Pos(0, 0, (height + thick + inner) / 2) * b.Rot(0, 90, 0) * b.Cylinder(
        bore / 2, 4 * thick
    )


def boss_foot(b: Any, size: Size) -> Any:
    """A rounded foot with a drafted boss and a bore through both."""
    length, width, thick, top, height, bore = size
    foot = b.extrude(b.RectangleRounded(length, width, min(length, width) / 6), thick)
    base = min(top * 1.35, width - 4)
    boss = b.loft([b.Circle(base / 2), b.Plane.XY.offset(height) * b.Circle(top / 2)])
    body = b.chamfer((foot + boss).edges().group_by(b.Axis.Z)[-1], 1.0)
    return body - b.Cylinder(bore / 2, 4 * height)


def _foot_pieces(_: trimesh.Trimesh, size: Size) -> list[np.ndarray]:
    """The foot around its bore, and wedges of the boss; the decomposition takes minutes for the cone."""
    length, width, thick, top, height, bore = size
    corner = min(length, width) / 6
    plan = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
    outline = shapely.get_coordinates(plan.buffer(-corner).buffer(corner, quad_segs=3))[:-1]
    base, hollow = min(top * 1.35, width - 4) / 2, bore / 2

    def radius(z: float) -> float:
        return base + (top / 2 - base) * z / height

    boss = [(hollow, thick), (radius(thick), thick), (radius(height - 1), height - 1),
            (top / 2 - 1, height), (hollow, height)]  # fmt: skip
    return s.around_hole(outline, s.bore_polygon(hollow), 0, thick) + turned_pieces(boss, HULL_DETAIL_MM)


def housing(b: Any, size: Size) -> Any:
    """An open box with rounded corners and ribs across."""
    length, width, height, wall, corner, ribs = size
    body = b.extrude(b.RectangleRounded(length, width, corner), height)
    body -= b.Pos(0, 0, wall) * b.extrude(
        b.RectangleRounded(length - 2 * wall, width - 2 * wall, max(corner - wall, 1)), height
    )
    low = (b.Align.CENTER, b.Align.CENTER, b.Align.MIN)
    for number in range(int(ribs)):
        x = (number + 1) * length / (int(ribs) + 1) - length / 2
        body += b.Pos(x, 0, 0) * b.Box(wall, width - wall, height * 0.6, align=low)
    return body


def yoke(b: Any, size: Size) -> Any:
    """A fork on a round shank, its ends rounded."""
    length, width, height, slot, bore, shank = size
    fork = length * 0.55
    body = b.Pos(-fork / 2, 0, 0) * b.Box(fork, width, height)
    body = b.fillet(body.edges().filter_by(b.Axis.Y).group_by(b.Axis.X)[0], height * 0.42)
    body += b.Pos((length - fork) / 2, 0, 0) * b.Rot(0, 90, 0) * b.Cylinder(shank / 2, length - fork)
    depth = fork * 0.7
    body -= b.Pos(-fork + depth / 2, 0, 0) * b.Box(depth, slot, 2 * height)
    return body - b.Pos(-fork + height / 2, 0, 0) * b.Rot(90, 0, 0) * b.Cylinder(bore / 2, 2 * width)


def hook(b: Any, size: Size) -> Any:
    """A round bar bent to an arc at one end."""
    shank, diameter, bar, angle, _, _ = size
    path = b.Line((0, shank, 0), (0, 0, 0)) + b.CenterArc((diameter / 2, 0, 0), diameter / 2, 180, angle)
    wire = b.Wire(path.edges())
    return b.sweep(b.Plane(wire @ 0, z_dir=wire % 0) * b.Circle(bar / 2), wire)


FAMILIES: dict[str, tuple[float, Callable[[Any, Size], Any]]] = {
    "boss_foot": (CAST_IRON, boss_foot),
    "cast_angle": (CAST_IRON, cast_angle),
    "hook": (STEEL, hook),
    "housing": (ALUMINIUM, housing),
    "lever": (CAST_IRON, lever),
    "nozzle": (POLYAMIDE, nozzle),
    "port_block": (ALUMINIUM, port_block),
    "yoke": (STEEL, yoke),
}
"""Density in kg/m^3 and the drawing of each family."""

HULLS: dict[str, Callable[[trimesh.Trimesh, Size], list[np.ndarray]]] = {
    "boss_foot": _foot_pieces,
    "port_block": _block_pieces,
    "nozzle": lambda mesh, _: merge_hulls(turned_hulls(mesh), 0.03),
}
"""Makers of the convex pieces of families that are not decomposed."""
