"""Angular parts: T-slot nut, L- and U-brackets, hinge, pillow block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe, table, table_row
from mskgrasp.parts.solids import solid as s

CAST_IRON = 7200.0

_KINDS = {
    1: ("l_bracket", STEEL),
    2: ("u_bracket", ALUMINIUM),
    3: ("hinge", STEEL),
    4: ("pillow_block", CAST_IRON),
}


def recipes() -> Iterator[Recipe]:
    """The built-in angular parts."""
    yield Recipe(
        name="t_nut_m16x18",
        family="t_nut",
        source="DIN 508",
        density=STEEL,
        dimensions=table_row("din508_t_nut.csv", d_mm=16),
        make=t_nut,
    )
    makers = {1: l_bracket, 2: u_bracket, 3: hinge, 4: pillow_block}
    for row in table("brackets.csv"):
        kind = int(row.pop("kind"))
        family, density = _KINDS[kind]
        yield Recipe(
            name=f"{family}_{row['a_mm']:.0f}x{row['b_mm']:.0f}",
            family=family,
            source="own dimensions",
            density=density,
            dimensions=row,
            make=makers[kind],
        )


def t_nut(size: dict[str, float]) -> s.Solid:
    """Square base between z = 0 and k, the neck above along x."""
    a, e, h, k, bore = size["a_mm"] / 2, size["e_mm"] / 2, size["h_mm"], size["k_mm"], size["d1_mm"] / 2
    body = _box(-e, e, -e, e, 0, k) + _box(-e, e, -a, a, 0, h) - s.drill(bore, (0, 0, -1), "z", h + 2)
    hole = s.bore_polygon(bore)
    hulls = s.around_hole(s.rectangle(-e, e, -e, e), hole, 0, k)
    return s.solid(body, hulls + s.around_hole(s.rectangle(-e, e, -a, a), hole, k, h))


def l_bracket(size: dict[str, float]) -> s.Solid:
    """Foot along x, wall along z, a weld in the corner, one hole in each leg."""
    a, b, w, t, hole = size["a_mm"], size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["hole_mm"] / 2
    weld = np.array([[t, t], [2 * t, t], [t, 2 * t]])
    foot_hole, wall_hole = (a + 2 * t) / 2, (b + 2 * t) / 2
    body = _box(0, a, -w, w, 0, t) + _box(0, t, -w, w, 0, b) + _along_y_body(weld, -w, w)
    body = (
        body - s.drill(hole, (foot_hole, 0, -1), "z", t + 2) - s.drill(hole, (-1, 0, wall_hole), "x", t + 2)
    )
    foot = s.around_hole(s.rectangle(0, a, -w, w), s.bore_polygon(hole, centre=(foot_hole, 0)), 0, t)
    wall = s.around_hole(s.rectangle(t, b, -w, w), s.bore_polygon(hole, centre=(wall_hole, 0)), 0, t)
    # The wall lies like the foot with x and z exchanged; it is symmetric in y, so no handedness is lost.
    wall = [points[:, [2, 1, 0]] for points in wall]
    return s.solid(body, [*foot, *wall, _along_y(weld, -w, w)])


def u_bracket(size: dict[str, float]) -> s.Solid:
    """A channel along x, open upwards, one hole in its base."""
    a, b, w, t, hole = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["hole_mm"] / 2
    body = _box(-a, a, -w, w, 0, b) - _box(-a - 1, a + 1, -w + t, w - t, t, b + 1)
    body = body - s.drill(hole, (0, 0, -1), "z", t + 2)
    base = s.around_hole(s.rectangle(-a, a, -w, w), s.bore_polygon(hole), 0, t)
    walls = [s.box(-a, a, -w, -w + t, t, b), s.box(-a, a, w - t, w, t, b)]
    return s.solid(body, [*base, *walls])


def hinge(size: dict[str, float]) -> s.Solid:
    """Two leaves at right angles about a knuckle along y; the screw holes are filled in the hulls."""
    a, b, r, t, hole = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["hole_mm"] / 2
    body = s.extrude(s.circle(r), -a, a).rotate((90.0, 0.0, 0.0))
    body = body + _box(0, b, -a, a, -r, -r + t) + _box(-r, -r + t, -a, a, 0, b)
    for y in (-a / 2, a / 2):
        body = body - s.drill(hole, ((r + b) / 2, y, -r - 1), "z", t + 2)
        body = body - s.drill(hole, (-r - 1, y, (r + b) / 2), "x", t + 2)
    knuckle = _along_y(s.balanced_polygon(r, 16, phase=np.pi / 16), -a, a)
    return s.solid(body, [knuckle, s.box(0, b, -a, a, -r, -r + t), s.box(-r, -r + t, -a, a, 0, b)])


def pillow_block(size: dict[str, float]) -> s.Solid:
    """A foot along x with a slot at each end, a round-topped housing with its bore along y."""
    a, b, w, t, bore = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"], size["hole_mm"] / 2
    radius, slot, slot_start = bore + 10.0, 4.5, a - 12.0
    body = _box(-a, a, -w, w, 0, t) + _along_y_body(_arch(radius, t / 2, b, s.CIRCLE_SEGMENTS // 2), -w, w)
    body = body - s.drill(bore, (0, -w - 1, b), "y", 2 * w + 2)
    body = (
        body
        - _box(slot_start, a + 1, -slot, slot, -1, t + 1)
        - _box(-a - 1, -slot_start, -slot, slot, -1, t + 1)
    )
    hole = s.bore_polygon(bore)
    housing = s.around_hole(_arch(radius, t, b, 16) - [0, b], hole, -w, w)
    hulls = [s.box(-slot_start, slot_start, -w, w, 0, t)]
    hulls += [points[:, [0, 2, 1]] + [0, 0, b] for points in housing]
    for x0, x1 in ((slot_start, a), (-a, -slot_start)):
        hulls += [s.box(x0, x1, -w, -slot, 0, t), s.box(x0, x1, slot, w, 0, t)]
    return s.solid(body, hulls)


def _arch(radius: float, z0: float, z1: float, segments: int) -> np.ndarray:
    """Outline in (x, z): upright sides from z0 to z1 with a half circle on top."""
    angle = np.linspace(0, np.pi, segments + 1)
    top = np.stack([radius * np.cos(angle), z1 + radius * np.sin(angle)], axis=1)
    return np.concatenate([[[-radius, z0], [radius, z0]], top])


def _along_y(outline_xz: np.ndarray, y0: float, y1: float) -> np.ndarray:
    return s.prism(outline_xz, y0, y1)[:, [0, 2, 1]]


def _along_y_body(outline_xz: np.ndarray, y0: float, y1: float) -> Manifold:
    return s.extrude(outline_xz, -y1, -y0).rotate((90.0, 0.0, 0.0))


def _box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Manifold:
    return s.extrude(s.rectangle(x0, x1, y0, y1), z0, z1)
