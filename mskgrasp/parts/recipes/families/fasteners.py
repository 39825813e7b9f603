"""Bolts, screws, nuts and washers, with threads modelled as cylinders of the nominal diameter."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts.recipes.families.listing import one
from mskgrasp.parts.recipes.recipe import Recipe, table_row
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.solid import Maker

Lengths = dict[int, tuple[int, ...]]
"""Nominal lengths for each thread diameter, millimetres."""

CHAMFER_CIRCLE = 0.95
"""Diameter of the flat face of a chamfered hexagon, as a fraction of the width across flats."""


HEX_BOLTS: Lengths = {
    6: (35, 50, 60),
    8: (35, 50, 65, 80),
    10: (30, 45, 60, 80, 100),
    12: (35, 50, 60, 80, 100, 120),
    14: (45, 70, 90, 110),
    16: (40, 60, 80, 100, 120, 130),
    20: (50, 65, 80, 100, 120),
    24: (50, 70, 90, 110, 130),
    30: (70, 90, 110),
}
SOCKET_SCREWS: Lengths = {
    6: (40, 60),
    8: (35, 50, 65, 80),
    10: (25, 40, 60, 80, 100),
    12: (30, 50, 70, 90, 110),
    14: (45, 65, 90, 120),
    16: (35, 50, 70, 90, 110, 130),
    20: (45, 60, 80, 100, 120),
    24: (50, 70, 90, 110),
    30: (60, 90),
}
HEX_NUTS = (16, 20, 24, 30, 36, 42, 48)
THIN_NUTS = (24, 30, 36, 42)
WASHERS = (20, 24, 30, 36)
LARGE_WASHERS = (16, 20, 24)


def recipes() -> Iterator[Recipe]:
    """The built-in screws, nuts and washers of the commonest standards."""
    yield from with_lengths("iso4017_hex_bolt.csv", HEX_BOLTS, "hex_bolt_m{d}x{l}", hex_bolt, "ISO 4017")
    yield from with_lengths(
        "iso4762_socket_screw.csv", SOCKET_SCREWS, "socket_screw_m{d}x{l}", socket_screw, "ISO 4762"
    )
    for file, sizes, name, make, source, family in (
        ("iso4032_hex_nut.csv", HEX_NUTS, "hex_nut_m{d}", hex_nut, "ISO 4032", "hex_nut"),
        ("iso4035_thin_nut.csv", THIN_NUTS, "thin_nut_m{d}", hex_nut, "ISO 4035", "thin_nut"),
        ("iso7089_washer.csv", WASHERS, "washer_m{d}", washer, "ISO 7089", "washer"),
        (
            "iso7093_large_washer.csv",
            LARGE_WASHERS,
            "large_washer_m{d}",
            washer,
            "ISO 7093-1",
            "large_washer",
        ),
    ):
        for d in sizes:
            yield one(table_row(file, d_mm=d), name, make, source=source, family=family)


def with_lengths(file_name: str, lengths: Lengths, name: str, make: Maker, source: str) -> Iterator[Recipe]:
    """A recipe for each thread diameter of a table and each of its nominal lengths."""
    for d, chosen in lengths.items():
        for length in chosen:
            row = table_row(file_name, d_mm=d) | {"l_mm": float(length)}
            yield one(row, name, make, source=source)


def hex_bolt(size: dict[str, float]) -> s.Solid:
    """Head below z = 0, shank above."""
    d, k, width, length = size["d_mm"], size["k_mm"], size["s_mm"], size["l_mm"]
    head = s.extrude(s.hexagon(width), -k, 0) ^ _chamfer_body(width, -k, 0, below=True, above=False)
    head_hull = s.cut([s.prism(s.hexagon(width), -k, 0)], *_chamfer_planes(width, -k, upward=False))
    shank, shank_hulls = _shank(d, length)
    return s.solid(head + shank, [*head_hull, *shank_hulls])


def socket_screw(size: dict[str, float]) -> s.Solid:
    """Head below z = 0 with its socket facing down, shank above."""
    k, t, radius = size["k_mm"], size["t_mm"], size["dk_mm"] / 2
    socket = s.hexagon(size["s_mm"])
    head = s.extrude(s.circle(radius), -k, 0) - s.extrude(socket, -k - 1, -k + t)
    rim = s.around_hole(s.round_outline(radius, 6), socket, -k, -k + t)
    shank, shank_hulls = _shank(size["d_mm"], size["l_mm"])
    return s.solid(head + shank, [*rim, *s.rod(radius, -k + t, 0, multiple=6), *shank_hulls])


def hex_nut(size: dict[str, float]) -> s.Solid:
    """Between z = 0 and its height, the bore at the thread's minor diameter."""
    m, width, bore = size["m_mm"], size["s_mm"], size["d1_mm"] / 2
    body = s.extrude(s.hexagon(width), 0, m, [s.circle(bore)])
    body = body ^ _chamfer_body(width, 0, m, below=True, above=True)
    hulls = s.around_hole(s.hexagon(width), s.bore_polygon(bore, multiple=6), 0, m)
    hulls = s.cut(hulls, *_chamfer_planes(width, 0, upward=False))
    hulls = s.cut(hulls, *_chamfer_planes(width, m, upward=True))
    return s.solid(body, hulls)


def washer(size: dict[str, float]) -> s.Solid:
    """A flat ring."""
    outer, bore, h = size["d2_mm"] / 2, size["d1_mm"] / 2, size["h_mm"]
    return s.solid(s.extrude(s.circle(outer), 0, h, [s.circle(bore)]), s.ring(outer, bore, 0, h))


def _shank(d: float, length: float) -> tuple[Manifold, list[np.ndarray]]:
    """A threaded shank with its end chamfered to about the thread's root."""
    chamfer = 0.1 * d
    body = s.lathe(
        [(0, -0.5), (d / 2, -0.5), (d / 2, length - chamfer), (d / 2 - chamfer, length), (0, length)]
    )
    tip = s.frustum(d / 2, d / 2 - chamfer, length - chamfer, length, sides=12)
    return body, [*s.rod(d / 2, 0, length - chamfer, multiple=6), tip]


def _chamfer_body(width: float, z0: float, z1: float, *, below: bool, above: bool) -> Manifold:
    """The double cone of 30 degrees that turned hexagons are chamfered to."""
    face, corner = CHAMFER_CIRCLE * width / 2, width
    drop = (corner - face) * np.tan(np.pi / 6)
    low = [(0, z0), (face, z0), (corner, z0 + drop)] if below else [(0, z0), (corner, z0)]
    high = [(corner, z1 - drop), (face, z1), (0, z1)] if above else [(corner, z1), (0, z1)]
    middle = [] if z0 + drop * below < z1 - drop * above else _cone_crossing(face, z0, z1)
    return s.lathe([*low, *high] if not middle else [low[0], low[1], *middle, high[-2], high[-1]])


def _cone_crossing(face: float, z0: float, z1: float) -> list[tuple[float, float]]:
    return [(face + (z1 - z0) / 2 / np.tan(np.pi / 6), (z0 + z1) / 2)]


def _chamfer_planes(width: float, z: float, *, upward: bool) -> tuple[list[np.ndarray], list[float]]:
    """Planes that cut a hexagon's corners as the chamfer does, touching its cone at the corners."""
    sign = 1.0 if upward else -1.0
    sin, cos = np.sin(np.pi / 6), np.cos(np.pi / 6)
    normals = [np.array([x * sin, y * sin, sign * cos]) for x, y in s.polygon(1.0, 6)]
    offset = CHAMFER_CIRCLE * width / 2 * sin + sign * z * cos
    return normals, [offset] * 6
