"""Straight pipe fittings, turned with hexagons: nipples, plugs, unions, barbs, glands, flanges, valves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import BRASS, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.families.pipe import MALLEABLE_IRON, STAINLESS
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in straight fittings and valves."""
    yield from one_per_row("hex_nipple.csv", "hex_nipple_{s}x{l}", hex_nipple, density=BRASS)
    yield from one_per_row("pipe_union.csv", "pipe_union_{d}x{l}", pipe_union, density=MALLEABLE_IRON)
    yield from one_per_row("square_plug.csv", "square_plug_{s}x{l}", square_plug, density=STEEL)
    yield from one_per_row("pipe_cap.csv", "pipe_cap_{s}x{l}", pipe_cap, density=BRASS)
    yield from one_per_row("hose_barb.csv", "hose_barb_{d}x{l}", hose_barb, density=BRASS)
    yield from one_per_row("cable_gland.csv", "cable_gland_{d}x{l}", cable_gland, density=POLYAMIDE)
    yield from one_per_row("kf_flange.csv", "kf_flange_{d}x{l}", kf_flange, density=STAINLESS)
    yield from one_per_row("neck_flange.csv", "neck_flange_{d}x{l}", neck_flange, density=ALUMINIUM)
    yield from one_per_row("ball_valve.csv", "ball_valve_{l}x{lever}", ball_valve, density=BRASS)
    yield from one_per_row("needle_valve.csv", "needle_valve_{l}x{h}", needle_valve, density=STAINLESS)
    yield from one_per_row("check_valve.csv", "check_valve_{l}x{s}", check_valve, density=BRASS)


def hex_nipple(size: dict[str, float]) -> s.Solid:
    """Two threads, of one size or two, and a hexagon between them; bored through."""
    low, high, length, m = size["d_mm"] / 2, size["e_mm"] / 2, size["l_mm"], size["m_mm"]
    start = 0.5 * (length - m)
    fitting = _bored(size["bore_mm"] / 2, [(0, start, low), (start, length, high)])
    return _with_hexagon(fitting, min(low, high), size["s_mm"], start, start + m).solid()


def pipe_union(size: dict[str, float]) -> s.Solid:
    """Two ends of equal bore and the large hexagonal nut that holds them together."""
    bore, tail, length, m = size["bore_mm"] / 2, size["d_mm"] / 2, size["l_mm"], size["m_mm"]
    start = 0.42 * (length - m)
    end, bead = start + m, 0.3 * (length - m)
    union = _bored(bore, [(0, length, tail)], [(0, bead, 1.14 * tail), (length - bead, length, 1.14 * tail)])
    return _with_hexagon(union, tail, size["s_mm"], start, end).solid()


def square_plug(size: dict[str, float]) -> s.Solid:
    """A thread, a collar, a square to turn it by."""
    thread, collar, length = size["d_mm"] / 2, size["collar_mm"] / 2, size["l_mm"]
    k, t, a = size["k_mm"], size["t_mm"], size["s_mm"] / 2
    plug = h.cylinder(thread, 0, length - k) + h.block(-a, a, -a, a, length - k - 0.2, length)
    if collar:
        plug += h.cylinder(collar, length - k - t, length - k)
    return plug.solid()


def pipe_cap(size: dict[str, float]) -> s.Solid:
    """A hexagonal cap with a domed top and a blind bore from below."""
    across, length, deep = size["s_mm"], size["l_mm"], size["deep_mm"]
    flat = 0.86 * length
    cap = h.hexagon_bar(across, 0, flat) - o.bore(size["bore_mm"] / 2, -1, deep)
    dome = h.turned([(0, flat - 0.2), (0.47 * across, flat - 0.2), (0.36 * across, length), (0, length)])
    return (cap + dome).solid()


def hose_barb(size: dict[str, float]) -> s.Solid:
    """A thread, a hexagon, a barbed tail: drawn smooth in the hulls; bored through."""
    thread, tail, bore = size["thread_mm"] / 2, size["d_mm"] / 2, size["bore_mm"] / 2
    length, m, k, barbs = size["l_mm"], size["m_mm"], size["k_mm"], int(size["barbs"])
    start = k + m
    pitch = (length - start) / barbs
    profile = [(bore, 0.0), (thread, 0.0), (thread, k), (0.96 * tail, start)]
    for n in range(barbs):
        z = start + n * pitch
        profile += [(0.96 * tail, z), (1.08 * tail, z), (0.96 * tail, z + pitch)]
    hulls = o.hollow(bore, thread, 0, k + 0.5) + o.hollow(bore, 1.02 * tail, k, length)
    fitting = h.tool(s.lathe([*profile, (bore, length)]), hulls)
    return _with_hexagon(fitting, min(thread, tail), size["s_mm"], k, start).solid()


def cable_gland(size: dict[str, float]) -> s.Solid:
    """A thread, a hexagon, a neck and a domed hexagonal nut; bored through."""
    thread, bore, across, length = size["d_mm"] / 2, size["bore_mm"] / 2, size["s_mm"], size["l_mm"]
    k, m = size["k_mm"], size["m_mm"]
    nut = k + m + 2
    gland = _bored(bore, [(0, length, thread)])
    gland = _with_hexagon(gland, thread, across, k, k + m)
    gland = _with_hexagon(gland, thread, across, nut, 0.8 * length)
    rim, top = 0.8 * length - 0.2, length - 0.5
    wide, narrow = 0.48 * across, 1.02 * thread
    body = gland.body + s.lathe([(0.9 * thread, rim), (wide, rim), (narrow, top), (0.9 * thread, top)])
    dome = o.collar(bore, thread, wide, rim, top)
    for points in dome:
        radius = np.hypot(points[:, 0], points[:, 1])
        tapered = (points[:, 2] > rim) & (radius > 1.05 * narrow)
        points[tapered, :2] *= narrow / wide
    return h.tool(body, [*gland.hulls, *dome]).solid()


def kf_flange(size: dict[str, float]) -> s.Solid:
    """A small vacuum flange on a length of tube: its rim tapers by 15 degrees behind the sealing face."""
    outer, bore, tube, length = size["D_mm"] / 2, size["bore_mm"] / 2, size["tube_mm"] / 2, size["l_mm"]
    rim = 3.0
    back = rim + (outer - tube - 1) * np.tan(np.radians(15))
    return h.turned(
        [(bore, 0), (outer, 0), (outer, rim), (tube + 1, back), (tube, back), (tube, length), (bore, length)]
    ).solid()


def neck_flange(size: dict[str, float]) -> s.Solid:
    """A flange with four bolt holes and a tapering welding neck."""
    outer, bore, t, length = size["D_mm"] / 2, size["bore_mm"] / 2, size["t_mm"], size["l_mm"]
    hub, pipe = size["hub_mm"] / 2, size["d_mm"] / 2
    profile = [
        (bore, 0),
        (outer, 0),
        (outer, t),
        (hub, t),
        (pipe, 0.75 * length),
        (pipe, length),
        (bore, length),
    ]
    flange = h.turned(profile)
    for angle in np.radians((45, 135, 225, 315)):
        x, y = size["circle_mm"] / 2 * np.array([np.cos(angle), np.sin(angle)])
        flange = flange.drilled(s.drill(size["hole_mm"] / 2, (float(x), float(y), -1), "z", t + 2))
    return flange.solid()


def ball_valve(size: dict[str, float]) -> s.Solid:
    """A valve along x with hexagonal ends, a round body, a stem and a flat lever along x."""
    half, across, bore, body = size["l_mm"] / 2, size["s_mm"], size["bore_mm"] / 2, size["body_mm"] / 2
    top, lever, t, w = size["h_mm"], size["lever_mm"], size["t_mm"], size["w_mm"] / 2
    c = 0.42 * half
    core = _bored(bore, [(-half, half, body)])
    for z0, z1 in ((-half, c - half), (half - c, half)):
        core = _with_hexagon(core, body, across, z0, z1)
    core = core.turned("y", 90)
    stem = h.cylinder(0.55 * w, 0.9 * body, top)
    handle = h.plate(o.belt((0, 0, w), (lever - 0.7 * w, 0, 0.7 * w)), top - t, top)
    return (core + stem + handle).solid()


def needle_valve(size: dict[str, float]) -> s.Solid:
    """A hexagonal bar along x bored for pipes, a bonnet along z with a round handle."""
    half, across, top = size["l_mm"] / 2, size["s_mm"], size["h_mm"]
    bore, knob, bonnet = size["bore_mm"] / 2, size["knob_mm"] / 2, size["bonnet_mm"]
    bar = h.hexagon_bar(across, -half, half).turned("y", 90)
    for x in (-half - 1, half - 0.3 * half):
        bar = bar.drilled(s.drill(bore, (x, 0, 0), "x", 0.3 * half + 1))
    neck = h.hexagon_bar(bonnet, 0, 0.5 * top)
    stem = h.cylinder(0.22 * bonnet, 0.4 * top, top)
    return (bar + neck + stem + h.cylinder(knob, 0.8 * top, top)).solid()


def check_valve(size: dict[str, float]) -> s.Solid:
    """A round body between hexagonal ends; bored through."""
    length, across, body, bore = size["l_mm"], size["s_mm"], size["body_mm"] / 2, size["bore_mm"] / 2
    c, tube = 0.24 * length, 0.45 * across
    valve = _bored(bore, [(0, length, tube)], [(c - 0.2, length - c + 0.2, body)])
    for z0, z1 in ((0, c), (length - c, length)):
        valve = _with_hexagon(valve, tube, across, z0, z1)
    return valve.solid()


def _bored(
    bore: float,
    core: Sequence[tuple[float, float, float]],
    collars: Sequence[tuple[float, float, float]] = (),
) -> h.Shape:
    """Tubes along z, (z0, z1, radius) each, with collars about them."""
    body = s.lathe([(bore, core[0][0]), *_steps(core), (bore, core[-1][1])])
    hulls = [piece for z0, z1, radius in core for piece in o.hollow(bore, radius, z0, z1)]
    least = min(radius for _, _, radius in core)
    for z0, z1, radius in collars:
        body = body + o.tube(radius, 0.98 * least, z0, z1).body
        hulls += o.collar(bore, least, radius, z0, z1)
    return h.tool(body, hulls)


def _steps(core: Sequence[tuple[float, float, float]]) -> list[tuple[float, float]]:
    return [(radius, z) for z0, z1, radius in core for z in (z0, z1)]


def _with_hexagon(shape: h.Shape, inner: float, across_flats: float, z0: float, z1: float) -> h.Shape:
    """A hexagon about a tube whose outer radius is ``inner``."""
    ring = s.extrude(s.hexagon(across_flats), z0, z1, [s.circle(0.92 * inner)])
    return h.tool(shape.body + ring, [*shape.hulls, *o.hexagonal_collar(inner, across_flats, z0, z1)])
