"""Grips to turn by hand: star, palm and ball knobs, mushroom heads, T-grips, knurled knobs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import OWN, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in knobs; sizes are within the range of catalogues."""
    yield from one_per_row(
        "star_knob.csv",
        "star_knob_{D}",
        lobed_knob,
        source=f"{OWN}, like DIN 6336",
        density=POLYAMIDE,
        family="star_knob",
    )
    yield from one_per_row(
        "palm_knob.csv",
        "palm_knob_{D}",
        lobed_knob,
        source=f"{OWN}, like DIN 6335",
        density=ALUMINIUM,
        family="palm_knob",
    )
    yield from one_per_row("tri_knob.csv", "tri_knob_{D}", lobed_knob, density=POLYAMIDE, family="tri_knob")
    yield from one_per_row(
        "star_screw.csv", "star_screw_{D}xm{d}x{l}", lobed_knob, density=STEEL, family="star_screw"
    )
    yield from one_per_row(
        "ball_knob.csv", "ball_knob_{D}", ball_knob, source=f"{OWN}, like DIN 319", density=POLYAMIDE
    )
    yield from one_per_row(
        "ball_screw_knob.csv", "ball_screw_knob_{D}xm{d}x{l}", ball_knob, family="ball_screw_knob"
    )
    yield from one_per_row("mushroom_knob.csv", "mushroom_knob_{D}x{h}", mushroom_knob, density=POLYAMIDE)
    yield from one_per_row("t_grip.csv", "t_grip_{L}x{h}", t_grip, density=POLYAMIDE)
    yield from one_per_row("knurled_knob.csv", "knurled_knob_{D}x{h}", knurled_knob, density=ALUMINIUM)
    yield from one_per_row("wing_grip.csv", "wing_grip_{L}xm{d}", wing_grip, density=POLYAMIDE)
    yield from one_per_row("tommy_screw.csv", "tommy_screw_m{d}x{l}", tommy_screw)


def lobed_knob(size: dict[str, float]) -> s.Solid:
    """A grip with round lobes on a hub."""
    outline = f.lobes(size["D_mm"] / 2, int(size["lobes"]), size["depth_mm"])
    total, low = size["h_mm"], size["hub_height_mm"]
    thick = total - low
    grip = f.tapered(outline, (low, 0.9), (low + 0.2 * thick, 1.0), (low + 0.7 * thick, 1.0), (total, 0.82))
    knob = grip + h.turned(
        [(0, 0), (size["hub_mm"] / 2, 0), (0.6 * size["hub_mm"], low + 0.1), (0, low + 0.1)]
    )
    return _fitted(knob, size)


def ball_knob(size: dict[str, float]) -> s.Solid:
    """A ball with a flat below."""
    radius, flat = size["D_mm"] / 2, size["flat_mm"] / 2
    centre = float(np.sqrt(radius**2 - flat**2))
    start = float(np.degrees(np.arcsin(-centre / radius)))
    ball = h.turned([(0.0, 0.0), *f.arc(radius, centre, start, 90, count=40)])
    return _fitted(ball, size)


def mushroom_knob(size: dict[str, float]) -> s.Solid:
    """A flat dome on a waisted neck."""
    radius, total, neck, foot = size["D_mm"] / 2, size["h_mm"], size["neck_mm"] / 2, size["foot_mm"] / 2
    cap = 0.42 * total
    edge = total - cap
    ball = (radius**2 + (0.7 * cap) ** 2) / (1.4 * cap)
    start = float(np.degrees(np.arccos(radius / ball)))
    dome = f.arc(ball, total - ball, start, 90)
    profile = [(0.0, 0.0), (foot, 0.0), (neck, 0.35 * total), (neck, edge - 0.1 * cap), (radius - 2, edge)]
    return _fitted(h.turned([*profile, (radius, edge + 0.1 * cap), *dome]), size)


def t_grip(size: dict[str, float]) -> s.Solid:
    """A round bar, thicker at its ends, across the top of a neck."""
    half, total, bar, neck = size["L_mm"] / 2, size["h_mm"], size["bar_mm"] / 2, size["neck_mm"] / 2
    end = [(0.8 * bar, 0.0), (bar, half - bar), (bar, half - 0.4 * bar), (0.6 * bar, half), (0.0, half)]
    across = h.turned([(0.0, 0.0), *end]).turned("y", 90)
    crossbar = (across + across.mirrored("x")).moved(z=total - bar)
    stem = h.turned([(0, 0), (neck, 0), (0.8 * neck, total - bar), (0, total - bar)])
    return _fitted(crossbar + stem, size)


def knurled_knob(size: dict[str, float]) -> s.Solid:
    """A knurled cylinder on a narrower skirt."""
    total, skirt = size["h_mm"], size["skirt_mm"]
    disc = f.knurled(size["D_mm"] / 2, skirt, total, depth=1.0, edge=1.2)
    return _fitted(disc + h.cylinder(0.38 * size["D_mm"], 0, skirt), size)


def wing_grip(size: dict[str, float]) -> s.Solid:
    """Two flat wings of a moulded wing screw, broad at their tips, on a hub."""
    half, total, hub, t = size["L_mm"] / 2, size["h_mm"], size["hub_mm"] / 2, size["t_mm"] / 2
    tip = 0.36 * total
    wing = o.along_y(o.belt((0, 0.3 * total, 0.22 * total), (half - tip, total - tip, tip)), -t, t)
    core = h.turned([(0, 0), (hub, 0), (0.85 * hub, 0.75 * total), (0, 0.75 * total)])
    return _fitted(core + wing + wing.mirrored("x"), size)


def tommy_screw(size: dict[str, float]) -> s.Solid:
    """A screw whose head holds a sliding bar with a ball at either end."""
    d, head, half, ball = size["d_mm"], size["head_mm"] / 2, size["bar_length_mm"] / 2, size["ball_mm"] / 2
    bar = size["bar_mm"] / 2
    top = 1.5 * size["head_mm"]
    rod = h.cylinder(bar, -half, half).turned("y", 90).moved(z=top / 2)
    profile = f.arc(ball, 0.0, -90, 90, count=20)
    end = h.turned(profile).turned("y", 90).moved(x=half, z=top / 2)
    body = h.cylinder(head, 0, top) + f.shank(d, 0, size["l_mm"]).mirrored("z")
    return (body + rod + end + end.mirrored("x")).solid()


def _fitted(knob: h.Shape, size: dict[str, float]) -> s.Solid:
    """The knob with its stud below z = 0, or with a threaded blind bore that the hulls fill."""
    if "l_mm" in size:
        return (knob + f.shank(size["d_mm"], 0, size["l_mm"]).mirrored("z")).solid()
    return knob.drilled(s.drill(size["bore_mm"] / 2, (0, 0, -1), "z", size["bore_depth_mm"] + 1)).solid()
