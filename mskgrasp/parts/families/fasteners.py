"""Bolts, screws, nuts and washers, without threads: a cylinder of the nominal diameter stands for one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts import solid as s
from mskgrasp.parts.families.recipe import STEEL, Recipe, table_row

CHAMFER_CIRCLE = 0.95
"""Diameter of the flat face of a chamfered hexagon, as a fraction of the width across flats."""


def recipes() -> Iterator[Recipe]:
    """The built-in fasteners."""
    for d, length in ((12, 60), (20, 50)):
        dimensions = table_row("iso4017_hex_bolt.csv", d_mm=d) | {"l_mm": float(length)}
        yield _recipe(f"hex_bolt_m{d}x{length}", "hex_bolt", "ISO 4017", dimensions, hex_bolt)
    for d, length in ((10, 60), (16, 50)):
        dimensions = table_row("iso4762_socket_screw.csv", d_mm=d) | {"l_mm": float(length)}
        yield _recipe(f"socket_screw_m{d}x{length}", "socket_screw", "ISO 4762", dimensions, socket_screw)
    for d in (20, 30):
        yield _recipe(
            f"hex_nut_m{d}", "hex_nut", "ISO 4032", table_row("iso4032_hex_nut.csv", d_mm=d), hex_nut
        )
    yield _recipe("washer_m36", "washer", "ISO 7089", table_row("iso7089_washer.csv", d_mm=36), washer)


def _recipe(name: str, family: str, source: str, dimensions: dict[str, float], make: s.Maker) -> Recipe:
    return Recipe(name=name, family=family, source=source, density=STEEL, dimensions=dimensions, make=make)


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
