"""Flat connecting parts of 4 mm and more: T-, Y- and L-plates, bars, links, gussets, lugs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in flat connecting parts."""
    yield from one_per_row("t_plate.csv", "t_plate_{a}x{b}x{w}", t_plate, density=ALUMINIUM)
    yield from one_per_row("corner_plate.csv", "corner_plate_{a}x{b}x{w}", corner_plate)
    yield from one_per_row("y_plate.csv", "y_plate_{a}x{w}", y_plate)
    yield from one_per_row("slotted_bar.csv", "slotted_bar_{l}x{w}", slotted_bar)
    yield from one_per_row("drilled_bar.csv", "drilled_bar_{l}x{w}x{t}", drilled_bar)
    yield from one_per_row("link_plate.csv", "link_plate_{p}x{w}", link_plate)
    yield from one_per_row("offset_bar.csv", "offset_bar_{l}x{w}x{b}", offset_bar)
    yield from one_per_row("gusset_plate.csv", "gusset_plate_{a}x{b}x{t}", gusset_plate)
    yield from one_per_row("lifting_lug.csv", "lifting_lug_{a}x{b}", lifting_lug)


def t_plate(size: dict[str, float]) -> s.Solid:
    """A bar along x with another from its middle towards +y; screw holes along both, filled in the hulls."""
    a, b, w, t, hole = size["a_mm"] / 2, size["b_mm"], size["w_mm"], size["t_mm"], size["hole_mm"] / 2
    outline = o.together(o.rounded(-a, a, 0, w, 3), o.rounded(-w / 2, w / 2, 0, b, 3))
    bars = (o.blunted(-a, a, 0, w, 3), o.blunted(-w / 2, w / 2, 0, b, 3))
    plate = h.tool(s.extrude(outline, 0, t), [s.prism(bar, 0, t) for bar in bars])
    for x, y in ((-a + w / 2, w / 2), (0, w / 2), (a - w / 2, w / 2), (0, b - w / 2)):
        plate = plate.drilled(s.drill(hole, (x, y, -1), "z", t + 2))
    return plate.solid()


def corner_plate(size: dict[str, float]) -> s.Solid:
    """A flat angle: bars along x and y with rounded ends, four screw holes, filled in the hulls."""
    a, b, w, t, hole = size["a_mm"], size["b_mm"], size["w_mm"], size["t_mm"], size["hole_mm"] / 2
    outline = o.together(o.rounded(0, a, 0, w, 4), o.rounded(0, w, 0, b, 4))
    bars = (o.blunted(0, a, 0, w, 4), o.blunted(0, w, 0, b, 4))
    plate = h.tool(s.extrude(outline, 0, t), [s.prism(bar, 0, t) for bar in bars])
    where = [(x, w / 2) for x in (w / 2, a / 2, a - w / 2)] + [(w / 2, b - w / 2)]
    for x, y in where:
        plate = plate.drilled(s.drill(hole, (x, y, -1), "z", t + 2))
    return plate.solid()


def y_plate(size: dict[str, float]) -> s.Solid:
    """Three round-ended arms at 120 degrees, a bore in each end and one in the middle."""
    reach, w, t, hole = size["a_mm"], size["w_mm"] / 2, size["t_mm"], size["hole_mm"] / 2
    ends = [reach * np.array([np.cos(angle), np.sin(angle)]) for angle in np.radians((90, 210, 330))]
    outline = o.together(*(o.belt((0, 0, w), (float(x), float(y), w)) for x, y in ends))
    plate = h.plate(outline, 0, t)
    for x, y in ((0, 0), *ends):
        plate = plate.drilled(s.drill(hole, (float(x), float(y), -1), "z", t + 2))
    return plate.solid()


def slotted_bar(size: dict[str, float]) -> s.Solid:
    """A bar along x with one or two slots along it, and a bore at its end."""
    length, w, t, half = size["l_mm"], size["w_mm"] / 2, size["t_mm"], size["slot_mm"] / 2
    bore, slots = size["bore_mm"] / 2, int(size["slots"])
    start = w + bore + half if bore else w
    pitch = (length - w / 2 - start) / slots
    windows = [
        o.slot(start + n * pitch + half, start + (n + 1) * pitch - 1.6 * half, 0, half) for n in range(slots)
    ]
    if bore:
        windows.append(s.circle(bore, (w, 0)))
    return o.pierced(s.rectangle(0, length, -w, w), 0, t, windows).solid()


def drilled_bar(size: dict[str, float]) -> s.Solid:
    """A flat bar along x with a row of bores."""
    length, w, t, holes = size["l_mm"] / 2, size["w_mm"] / 2, size["t_mm"], int(size["holes"])
    where = [2 * length * ((n + 0.5) / holes - 0.5) for n in range(holes)]
    windows = [(x, 0.0, size["bore_mm"] / 2) for x in where]
    return h.plate(s.rectangle(-length, length, -w, w), 0, t, windows).solid()


def link_plate(size: dict[str, float]) -> s.Solid:
    """Two eyes joined by a waist, as in links of heavy chains; x runs from eye to eye."""
    p, eye, waist, t = size["p_mm"] / 2, size["w_mm"] / 2, size["waist_mm"] / 2, size["t_mm"]
    outline = o.together(s.circle(eye, (-p, 0)), s.circle(eye, (p, 0)), s.rectangle(-p, p, -waist, waist))
    bore = size["bore_mm"] / 2
    return h.plate(outline, 0, t, [(-p, 0, bore), (p, 0, bore)]).solid()


def offset_bar(size: dict[str, float]) -> s.Solid:
    """A joggled flat bar along x: two level ends, one higher by b, a slope of 45 degrees between them."""
    length, b, w, t = size["l_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    rise, skew = b / 2, 0.414 * t  # tan(22.5 degrees): the slope is as thick as the ends
    lower = [(-length, 0), (-rise, 0), (rise, b), (length, b)]
    upper = [(length, b + t), (rise - skew, b + t), (-rise - skew, t), (-length, t)]
    section = [*lower, *upper]
    hole, reach = size["hole_mm"] / 2, length - w
    bar = o.along_y(section, -w, w)
    return bar.drilled(*(s.drill(hole, (x, 0, -1), "z", b + 3 * t) for x in (-reach, reach))).solid()


def gusset_plate(size: dict[str, float]) -> s.Solid:
    """A right-angled gusset with its corner cut off for the weld and its tips blunted; two screw holes."""
    a, b, t, cut, tip = size["a_mm"], size["b_mm"], size["t_mm"], size["cut_mm"], size["tip_mm"]
    outline = np.array([[cut, 0], [a, 0], [a, tip], [tip, b], [0, b], [0, cut]])
    plate = h.plate(outline, 0, t)
    for x, y in ((0.55 * a, 0.16 * b), (0.16 * a, 0.55 * b)):
        plate = plate.drilled(s.drill(size["hole_mm"] / 2, (x, y, -1), "z", t + 2))
    return plate.solid()


def lifting_lug(size: dict[str, float]) -> s.Solid:
    """A pad eye: an upright plate that narrows to a round eye, on a foot to be welded."""
    a, b, t, eye = size["a_mm"] / 2, size["b_mm"], size["t_mm"] / 2, size["eye_mm"] / 2
    foot = size["foot_mm"]
    outline = o.belt((0, b - eye, eye), (-a + 1, foot / 2, 1), (a - 1, foot / 2, 1))
    lug = h.plate(outline, -t, t, [(0, b - eye, size["bore_mm"] / 2)]).turned("x", 90)
    return (lug + h.block(-a, a, -size["w_mm"] / 2, size["w_mm"] / 2, 0, foot)).solid()
