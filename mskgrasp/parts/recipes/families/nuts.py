"""Nuts with special shapes, T-nuts and thick washers; bores at the minor diameter of the thread."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
import shapely.affinity

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.brackets import t_nut
from mskgrasp.parts.recipes.families.listing import OWN, one, one_per_row
from mskgrasp.parts.recipes.families.screws import flange, knurled_head, wings
from mskgrasp.parts.recipes.recipe import Recipe, table, table_row
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.pieces import convex_polygons

T_NUTS = (12, 20, 24, 30, 36)
CAP_NUTS = (12, 14, 16, 18, 20, 24)


def recipes() -> Iterator[Recipe]:
    """The built-in nuts besides the plain ones, and the washers that are no thin discs."""
    yield from one_per_row("high_nut.csv", "high_nut_m{d}", high_nut, source=f"{OWN}, like DIN 6330, form B")
    yield from one_per_row(
        "coupling_nut.csv", "coupling_nut_m{d}", coupling_nut, source=f"{OWN}, like DIN 6334"
    )
    yield from one_per_row("din935_castle_nut.csv", "castle_nut_m{d}", castle_nut, source="DIN 935-1")
    yield from one_per_row("square_nut.csv", "square_nut_m{d}", square_nut, source=f"{OWN}, like DIN 557")
    yield from one_per_row("din6923_flange_nut.csv", "flange_nut_m{d}", flange_nut, source="DIN 6923")
    for d in CAP_NUTS:
        yield one(table_row("din1587_cap_nut.csv", d_mm=d), "cap_nut_m{d}", cap_nut, source="DIN 1587")
    for row in table("din315_wing_nut.csv"):
        yield one(row, "wing_nut_m{d}", wing_nut, source="DIN 315; outline own dimensions")
    yield from one_per_row("din464_thumb_screw.csv", "knurled_nut_m{d}", knurled_nut, source="DIN 466")
    for d in T_NUTS:
        yield one(table_row("din508_t_nut.csv", d_mm=d), "t_nut_m{d}x{a}", t_nut, source="DIN 508")
    yield from one_per_row("long_t_nut.csv", "long_t_nut_m{d}x{l}", long_t_nut)
    yield from one_per_row("din6340_thick_washer.csv", "thick_washer_m{d}", thick_washer, source="DIN 6340")
    yield from one_per_row(
        "square_washer.csv", "square_washer_m{d}", square_washer, source=f"{OWN}, like DIN 436"
    )
    yield from one_per_row("c_washer.csv", "c_washer_m{d}", c_washer, source=f"{OWN}, like DIN 6372")


def high_nut(size: dict[str, float]) -> s.Solid:
    """A hexagon nut with a spherical seat at the lower end."""
    width, m, seat = size["s_mm"], size["m_mm"], size["seat_mm"]
    # The sphere meets the bore's edge at z = 0; beyond the flats it leaves the hexagon alone.
    rb = size["d1_mm"] / 2
    centre = (seat**2 - rb**2) ** 0.5
    reach = 0.47 * width
    rise = centre - (seat**2 - reach**2) ** 0.5
    ring = f.hex_ring(width, rb, rise, m)
    start, end = (float(np.degrees(np.arcsin(r / seat))) - 90 for r in (rb, reach))
    cap = h.turned([*f.arc(seat, centre, start, end, count=8), (reach, rise + 0.01), (rb, rise + 0.01)])
    return (ring + cap).solid()


def coupling_nut(size: dict[str, float]) -> s.Solid:
    """A long hexagon, threaded through."""
    return f.hex_ring(size["s_mm"], size["d1_mm"] / 2, 0, size["m_mm"]).solid()


def castle_nut(size: dict[str, float]) -> s.Solid:
    """A hexagon nut whose round crown has six slots for a split pin."""
    w, top, bore, crown = size["w_mm"], size["m_mm"], size["d1_mm"] / 2, size["de_mm"] / 2
    n = size["n_mm"] / 2
    ring = s.extrude(s.circle(crown), w, top, [s.circle(bore)])
    region = shapely.Polygon(s.round_outline(crown, 6)).difference(
        shapely.Polygon(s.balanced_polygon(bore, 12))
    )
    slot = h.block(-crown - 1, crown + 1, -n, n, w, top + 1)
    for degrees in (30, 90, 150):
        ring = ring - slot.turned("z", degrees).body
        line = shapely.Polygon(s.rectangle(-crown - 1, crown + 1, -n, n))
        region = region.difference(shapely.affinity.rotate(line, degrees, origin=(0, 0)))
    pieces = [s.prism(piece, w, top) for piece in convex_polygons(region)]
    return (f.hex_ring(size["s_mm"], bore, 0, w) + h.tool(ring, pieces)).solid()


def square_nut(size: dict[str, float]) -> s.Solid:
    """A square plate with a bore."""
    half = size["s_mm"] / 2
    return h.plate(
        s.rectangle(-half, half, -half, half), 0, size["m_mm"], [(0, 0, size["d1_mm"] / 2)]
    ).solid()


def flange_nut(size: dict[str, float]) -> s.Solid:
    """A hexagon nut on a sloping flange."""
    bore, width = size["d1_mm"] / 2, size["s_mm"]
    return (
        flange(size["dc_mm"], size["c_mm"], width, bore) + f.hex_ring(width, bore, 0, size["m_mm"])
    ).solid()


def cap_nut(size: dict[str, float]) -> s.Solid:
    """A hexagon nut closed by a dome; the blind bore opens at z = 0."""
    bore, m, height, t = size["d1_mm"] / 2, size["m_mm"], size["h_mm"], size["t_mm"]
    dome = size["dk_mm"] / 2
    profile = [(bore, m), (dome, m), *f.arc(dome, height - dome, 0, 90), (0.0, t), (bore, t)]
    return (f.hex_ring(size["s_mm"], bore, 0, m) + h.turned(profile)).solid()


def wing_nut(size: dict[str, float]) -> s.Solid:
    """A tapering hub with a bore and two wings."""
    bore, m = size["d1_mm"] / 2, size["m_mm"]
    low, high = size["d2_mm"] / 2, size["d3_mm"] / 2
    hub = h.turned([(bore, 0), (low, 0), (high, m), (bore, m)])
    return (hub + wings(size, (bore + high) / 2)).solid()


def knurled_nut(size: dict[str, float]) -> s.Solid:
    """A knurled disc on a collar, threaded through."""
    return (knurled_head(size) - o.bore(size["d1_mm"] / 2, -1, size["h_mm"] + 1)).solid()


def long_t_nut(size: dict[str, float]) -> s.Solid:
    """A T-slot nut along x, with threaded holes in a row."""
    length, a, e = size["l_mm"], size["a_mm"] / 2, size["e_mm"] / 2
    k, top, count, r = size["k_mm"], size["h_mm"], int(size["holes"]), size["d1_mm"] / 2
    body = h.block(0, length, -e, e, 0, k) + h.block(0, length, -a, a, k, top)
    # A column as wide as the neck for each hole, and the base's two edges along all of them.
    hulls = [s.box(0, length, -e, -a, 0, k), s.box(0, length, a, e, 0, k)]
    pitch = length / count
    for n in range(count):
        middle = (n + 0.5) * pitch
        body = body.drilled(s.drill(r, (middle, 0, -1), "z", top + 2))
        hole = s.balanced_polygon(r, 8, np.pi / 8, centre=(middle, 0))
        hulls += s.around_hole(s.rectangle(n * pitch, (n + 1) * pitch, -a, a), hole, 0, top)
    return h.tool(body.body, hulls).solid()


def thick_washer(size: dict[str, float]) -> s.Solid:
    """A thick ring with its upper edge chamfered."""
    bore, outer, height = size["d1_mm"] / 2, size["d2_mm"] / 2, size["h_mm"]
    edge = 0.2 * height
    return h.turned(
        [(bore, 0), (outer, 0), (outer, height - edge), (outer - edge, height), (bore, height)]
    ).solid()


def square_washer(size: dict[str, float]) -> s.Solid:
    """A square plate with a hole."""
    half = size["a_mm"] / 2
    return h.plate(
        s.rectangle(-half, half, -half, half), 0, size["h_mm"], [(0, 0, size["d1_mm"] / 2)]
    ).solid()


def c_washer(size: dict[str, float]) -> s.Solid:
    """A ring with a slot from the side, to slip under a nut."""
    r, outer, height = size["d1_mm"] / 2, size["d2_mm"] / 2, size["h_mm"]
    slot = o.belt((0, 0, r), (2 * outer, 0, r))
    region = shapely.Polygon(s.circle(outer)).difference(shapely.Polygon(slot))
    return h.plate(np.asarray(shapely.get_coordinates(region))[:-1], 0, height).solid()
