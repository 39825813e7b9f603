"""Screws and bolts with special heads: flanges, domes, shoulders, T-heads, knurls, wings.

Heads lie below z = 0, shanks above; threads are cylinders of the nominal diameter.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.fasteners import Lengths, with_lengths
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s

FLANGE_BOLTS: Lengths = {8: (40, 70), 10: (45, 75, 95), 12: (40, 60, 110), 16: (50, 80, 120)}
BUTTON_SCREWS: Lengths = {8: (45, 70), 10: (40, 80), 12: (50, 90), 16: (45, 70, 100)}
COUNTERSUNK_SCREWS: Lengths = {8: (60, 80), 10: (50, 90), 12: (60, 100), 16: (50, 80), 20: (60, 100)}
SHOULDER_SCREWS: Lengths = {6: (50, 80), 8: (40, 60, 100), 10: (50, 80), 12: (40, 70, 100), 16: (50, 80, 100)}
CARRIAGE_BOLTS: Lengths = {
    8: (50, 80),
    10: (50, 70, 100),
    12: (60, 90, 120),
    16: (60, 90, 120),
    20: (80, 110),
}
T_SLOT_BOLTS: Lengths = {
    8: (50, 80),
    10: (63, 100),
    12: (50, 80, 125),
    16: (63, 80, 100),
    20: (80, 100),
    24: (63, 100),
}
THUMB_SCREWS: Lengths = {6: (25,), 8: (20, 28), 10: (20, 30, 40)}
WING_SCREWS: Lengths = {6: (30, 50), 8: (30, 60), 10: (30, 50, 80), 12: (40, 70), 16: (50, 80)}


def recipes() -> Iterator[Recipe]:
    """The built-in screws with special heads."""
    for file, lengths, name, make, source in (
        ("en1665_flange_bolt.csv", FLANGE_BOLTS, "heavy_flange_bolt_m{d}x{l}", heavy_flange_bolt, "EN 1665"),
        ("iso7380_button_screw.csv", BUTTON_SCREWS, "button_screw_m{d}x{l}", button_screw, "ISO 7380-1"),
        (
            "iso10642_countersunk_screw.csv",
            COUNTERSUNK_SCREWS,
            "countersunk_screw_m{d}x{l}",
            countersunk_screw,
            "ISO 10642",
        ),
        (
            "iso7379_shoulder_screw.csv",
            SHOULDER_SCREWS,
            "shoulder_screw_m{d}x{l}",
            shoulder_screw,
            "ISO 7379",
        ),
        ("din603_carriage_bolt.csv", CARRIAGE_BOLTS, "carriage_bolt_m{d}x{l}", carriage_bolt, "DIN 603"),
        (
            "t_slot_bolt.csv",
            T_SLOT_BOLTS,
            "t_slot_bolt_m{d}x{l}",
            t_slot_bolt,
            "own dimensions, like DIN 787",
        ),
        ("din464_thumb_screw.csv", THUMB_SCREWS, "thumb_screw_m{d}x{l}", thumb_screw, "DIN 464"),
        (
            "din315_wing_nut.csv",
            WING_SCREWS,
            "wing_screw_m{d}x{l}",
            wing_screw,
            "DIN 316; outline and lengths own dimensions",
        ),
    ):
        yield from with_lengths(file, lengths, name, make, source)


def heavy_flange_bolt(size: dict[str, float]) -> s.Solid:
    """A hexagon on a flange whose top slopes by 25 degrees."""
    d, k, width = size["d_mm"], size["k_mm"], size["s_mm"]
    head = flange(size["dc_mm"], size["c_mm"], width).mirrored("z") + h.hexagon_bar(width, -k, -size["c_mm"])
    return (head + f.shank(d, 0, size["l_mm"])).solid()


def flange(diameter: float, edge: float, width: float, bore: float = 0.0) -> h.Shape:
    """A round flange upward from z = 0, its top sloping by 25 degrees as far as a hexagon's flats."""
    outer, inner = diameter / 2, 0.45 * width
    top = edge + (outer - inner) * np.tan(np.radians(25))
    return h.turned([(bore, 0), (outer, 0), (outer, edge), (inner, top), (bore, top)])


def button_screw(size: dict[str, float]) -> s.Solid:
    """A low dome with a hexagon socket; the hulls fill the socket."""
    radius, k = size["dk_mm"] / 2, size["k_mm"]
    flat = 0.45 * radius
    centre = (radius**2 - flat**2 - k**2) / (2 * k)  # of the dome's circle, above the bearing face
    ball = float(np.hypot(radius, centre))
    start, end = np.degrees(np.arctan2(-centre, radius)), np.degrees(np.arctan2(-k - centre, flat))
    dome = [(0.0, 0.0), *f.arc(ball, centre, start, end), (0.0, -k)]
    socket = s.extrude(s.hexagon(size["s_mm"]), -k - 1, -k + size["t_mm"])
    return (h.turned(dome).drilled(socket) + f.shank(size["d_mm"], 0, size["l_mm"])).solid()


def countersunk_screw(size: dict[str, float]) -> s.Solid:
    """A cone of 90 degrees; the length includes the head, which starts at z = 0."""
    radius, r, t = size["dk_mm"] / 2, size["d_mm"] / 2, size["t_mm"]
    rim = 0.04 * size["d_mm"]
    cone = h.turned([(0, 0), (radius, 0), (radius, rim), (r, rim + radius - r), (0, rim + radius - r)])
    shape = cone + f.shank(size["d_mm"], rim, size["l_mm"])
    return shape.drilled(s.extrude(s.hexagon(size["s_mm"]), -1, t)).solid()


def shoulder_screw(size: dict[str, float]) -> s.Solid:
    """Head with a socket, ground shoulder, thinner thread."""
    ds, length = size["ds_mm"] / 2, size["l_mm"]
    head = f.socket_head(size["dk_mm"], size["k_mm"], size["s_mm"], size["t_mm"])
    shoulder = h.cylinder(ds, 0, length)
    return (head + shoulder + f.shank(size["d_mm"], length, length + size["b_mm"])).solid()


def carriage_bolt(size: dict[str, float]) -> s.Solid:
    """A mushroom head on a square neck."""
    radius, k, v = size["dk_mm"] / 2, size["k_mm"], size["v_mm"] / 2
    ball = (radius**2 + k**2) / (2 * k)
    start = float(np.degrees(np.arcsin((ball - k) / ball)))
    dome = h.turned([(0.0, 0.0), *((x, -z) for x, z in f.arc(ball, k - ball, start, 90))])
    neck = h.block(-v, v, -v, v, 0, size["f_mm"])
    return (dome + neck + f.shank(size["d_mm"], 0, size["l_mm"])).solid()


def t_slot_bolt(size: dict[str, float]) -> s.Solid:
    """A square head, a neck with two flats that fits the slot, a shank."""
    a, e, k, neck = size["a_mm"] / 2, size["e_mm"] / 2, size["k_mm"], size["neck_mm"]
    head = h.block(-e, e, -e, e, -k, 0) + h.block(-a, a, -a, a, 0, neck)
    return (head + f.shank(size["d_mm"], 0, size["l_mm"])).solid()


def thumb_screw(size: dict[str, float]) -> s.Solid:
    """A knurled disc on a collar, high type; the slot across the disc stays out of the hulls."""
    return (knurled_head(size).mirrored("z") + f.shank(size["d_mm"], 0, size["l_mm"])).solid()


def knurled_head(size: dict[str, float]) -> h.Shape:
    """Collar from z = 0 upward, knurled disc on top of it."""
    total, k = size["h_mm"], size["k_mm"]
    disc = f.knurled(size["dk_mm"] / 2, total - k, total)
    return disc + h.cylinder(size["ds_mm"] / 2, 0, total - k)


def wing_screw(size: dict[str, float]) -> s.Solid:
    """A hub with two wings below z = 0."""
    hub = h.turned([(0, 0), (size["d2_mm"] / 2, 0), (size["d3_mm"] / 2, size["m_mm"]), (0, size["m_mm"])])
    head = hub + wings(size, size["d2_mm"] / 4)
    return (head.mirrored("z") + f.shank(size["d_mm"], 0, size["l_mm"])).solid()


def wings(size: dict[str, float], start: float) -> h.Shape:
    """Two ears in the xz-plane, from a radius inside the hub to the full span."""
    span, height, m, g = size["e_mm"] / 2, size["h_mm"], size["m_mm"], size["g_mm"] / 2
    tip = 0.3 * height
    ear = o.belt((start + 0.5, 0.25 * m, 0.5), (start + 0.5, m - 0.5, 0.5), (span - tip, height - tip, tip))
    right = o.along_y(ear, -g, g)
    return right + right.mirrored("x")
