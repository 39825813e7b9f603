"""Wheels for belts, chains and rails: timing, V- and flat pulleys, sprockets, rollers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from mskgrasp.parts.recipes.families.listing import CAST_IRON, OWN, POLYAMIDE, POLYURETHANE, one_per_row
from mskgrasp.parts.recipes.families.rings import tube
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in wheels."""
    for file_name, name, make, density, source in (
        ("timing_pulley.csv", "timing_pulley_p{p}_z{teeth}x{width}", timing_pulley, ALUMINIUM, OWN),
        ("fine_timing_pulley.csv", "fine_timing_pulley_p{p}_z{teeth}x{width}", fine_timing_pulley, ALUMINIUM,
         "own dimensions, pitches of ISO 5294"),
        ("iso4183_v_pulley.csv", "v_pulley_{dd}x{grooves}x{L}", v_pulley, CAST_IRON,
         "grooves of ISO 4183; own bores and hubs"),
        ("flat_pulley.csv", "flat_pulley_{D}x{width}", flat_pulley, ALUMINIUM, OWN),
        ("flanged_roller.csv", "flanged_roller_{D}x{width}", flanged_roller, STEEL, OWN),
        ("iso606_sprocket.csv", "sprocket_p{p}_z{teeth}x{L}", sprocket, STEEL,
         "teeth of ISO 606; own bores and hubs"),
        ("journal_roller.csv", "journal_roller_{D}x{width}", journal_roller, POLYURETHANE, OWN),
        ("grooved_roller.csv", "grooved_roller_{D}x{L}", grooved_roller, POLYAMIDE, OWN),
        ("guide_wheel.csv", "guide_wheel_{D}x{L}", guide_wheel, POLYAMIDE, OWN),
    ):  # fmt: skip
        yield from one_per_row(file_name, name, make, density=density, source=source)


def timing_pulley(size: dict[str, float]) -> s.Solid:
    """Straight-sided teeth between two flanges, a hub above."""
    teeth, bore, width = int(size["teeth"]), size["bore_mm"] / 2, size["width_mm"]
    t, hub, top = size["flange_mm"], size["hub_mm"] / 2, size["L_mm"]
    tip = size["p_mm"] * teeth / np.pi / 2 - size["u_mm"]
    root, flange, high = tip - size["deep_mm"], tip + size["rim_mm"], 2 * t + width
    profile = [(bore, 0), (flange, 0), (flange, t), (root, t), (root, high - t), (flange, high - t)]
    core = sh.turned([*profile, (flange, high), (hub, high), (hub, top), (bore, top)])
    tooth, foot = np.pi / teeth * size["share"], np.pi / teeth * (size["share"] + 0.18)
    corners = [(root - 0.5, foot), (root, foot), (tip, tooth)]
    low = np.array([[r * np.cos(a), -r * np.sin(a)] for r, a in corners])
    edge = sh.plate(np.concatenate([low, low[::-1] * [1, -1]]), t - 0.1, high - t + 0.1)
    for number in range(teeth):
        core = core + edge.turned("z", 360 * number / teeth)
    return core.solid(merge=False)


def fine_timing_pulley(size: dict[str, float]) -> s.Solid:
    """A pulley whose grooves are too fine for a finger: in the hulls a cylinder of mean radius."""
    teeth, bore, width = int(size["teeth"]), size["bore_mm"] / 2, size["width_mm"]
    t, hub, top = size["flange_mm"], size["hub_mm"] / 2, size["L_mm"]
    tip = size["p_mm"] * teeth / np.pi / 2 - size["u_mm"]
    flange, high, mean = tip + size["rim_mm"], 2 * t + width, tip - 0.5 * size["deep_mm"]

    def wheel(radius: float) -> sh.Shape:
        profile = [(bore, 0), (flange, 0), (flange, t), (radius, t), (radius, high - t), (flange, high - t)]
        return sh.turned([*profile, (flange, high), (hub, high), (hub, top), (bore, top)])

    half = size["share"] * np.pi / teeth
    cut = np.array(
        [
            [(tip - size["deep_mm"]) * np.cos(0.8 * half), (tip - size["deep_mm"]) * np.sin(0.8 * half)],
            [(tip + 0.1) * np.cos(half), (tip + 0.1) * np.sin(half)],
        ]
    )
    cut = np.concatenate([cut[::-1] * [1, -1], cut])
    groove = s.extrude(cut, t, high - t)
    body = wheel(tip).body
    for number in range(teeth):
        body = body - groove.rotate((0.0, 0.0, 360 * number / teeth))
    return sh.tool(body, wheel(mean).hulls).solid()


def v_pulley(size: dict[str, float]) -> s.Solid:
    """Grooves for V-belts, a bored hub above."""
    outer, bore, hub = size["dd_mm"] / 2 + size["b_mm"], size["bore_mm"] / 2, size["hub_mm"] / 2
    slope = np.tan(np.radians(size["angle_deg"] / 2))
    floor, count = size["dd_mm"] / 2 - size["h_mm"], int(size["grooves"])
    wide = size["wd_mm"] / 2 + size["b_mm"] * slope
    narrow = size["wd_mm"] / 2 - size["h_mm"] * slope
    rim = 2 * size["f_mm"] + (count - 1) * size["e_mm"]
    profile = [(bore, 0.0), (outer, 0.0)]
    for number in range(count):
        z = size["f_mm"] + number * size["e_mm"]
        profile += [(outer, z - wide), (floor, z - narrow), (floor, z + narrow), (outer, z + wide)]
    profile += [(outer, rim)] + [(hub, rim), (hub, size["L_mm"])] * int(size["L_mm"] > rim)
    return sh.turned([*profile, (bore, size["L_mm"])]).solid()


def flat_pulley(size: dict[str, float]) -> s.Solid:
    """An idler for a flat belt: crowned face, bore with a wider seat for a bearing at each end."""
    outer, bore, seat, width = size["D_mm"] / 2, size["bore_mm"] / 2, size["seat_mm"] / 2, size["width_mm"]
    deep, crown = size["deep_mm"], size["crown_mm"]
    end = sh.turned([(seat, 0), (outer - crown, 0), (outer, deep), (seat, deep)])
    middle = tube(outer, bore, deep, width - deep)
    return (end + middle + end.mirrored("z").moved(z=width)).solid()


def flanged_roller(size: dict[str, float]) -> s.Solid:
    """A bored roller with a flange at one end."""
    outer, bore, flange = size["D_mm"] / 2, size["bore_mm"] / 2, size["flange_mm"] / 2
    t, top = size["t_mm"], size["width_mm"]
    return sh.turned([(bore, 0), (flange, 0), (flange, t), (outer, t), (outer, top), (bore, top)]).solid()


def sprocket(size: dict[str, float]) -> s.Solid:
    """A toothed disc for a roller chain, a hub above."""
    teeth, bore, hub = int(size["teeth"]), size["bore_mm"] / 2, size["hub_mm"] / 2
    width, top, roller = size["width_mm"], size["L_mm"], size["d1_mm"] / 2
    pitch = size["p_mm"] / 2 / np.sin(np.pi / teeth)
    root = pitch - roller
    # Half way between the tip diameters that ISO 606 allows at most and at least.
    tip = pitch + (1.25 + 1 - 1.6 / teeth) * size["p_mm"] / 4 - roller
    tooth = _sprocket_tooth(pitch, roller, teeth, tip)
    teeth_outline = [
        shapely.affinity.rotate(shapely.Polygon(tooth), 360 * (n + 0.5) / teeth, origin=(0, 0))
        for n in range(teeth)
    ]
    # The disc reaches to where the seats end and the flanks begin.
    disc = float(np.hypot(*tooth[1]))
    region: Any = shapely.unary_union([shapely.Polygon(s.polygon(disc, 360)), *teeth_outline])
    for number in range(teeth):
        angle = 2 * np.pi * number / teeth
        seat = s.polygon(roller, 64) + pitch * np.array([np.cos(angle), np.sin(angle)])
        region = region.difference(shapely.Polygon(seat))
    outline = np.asarray(shapely.get_coordinates(region.exterior.simplify(0.01)))[:-1]
    body = s.extrude(outline, 0, width) - s.extrude(s.circle(bore), -1, width + 1)
    wheel = tube(root, bore, 0, width)
    hulls = list(wheel.hulls)
    for number in range(teeth):
        turn = 2 * np.pi * (number + 0.5) / teeth
        cos, sin = np.cos(turn), np.sin(turn)
        hulls.append(s.prism(tooth @ np.array([[cos, sin], [-sin, cos]]), 0, width))
    return (sh.tool(body, hulls) + tube(hub, bore, width - 0.5, top)).solid(merge=False)


def _sprocket_tooth(pitch: float, roller: float, teeth: int, tip: float) -> np.ndarray:
    """The convex part of the tooth that points along +x: its two flanks, bulging, and its foot."""
    gap = pitch * np.array([np.cos(np.pi / teeth), np.sin(np.pi / teeth)])
    flank = 0.12 * 2 * roller * (teeth + 2)  # ISO 606: least flank radius
    half_seat = np.radians((130 - 90 / teeth) / 2)  # middle of the seating angles that ISO 606 allows
    # From the gap's centre, the seat ends where it meets the flank, towards the tooth.
    inward = np.arctan2(-gap[1], -gap[0])
    to_flank = inward + half_seat
    direction = np.array([np.cos(to_flank), np.sin(to_flank)])
    end, centre = gap + roller * direction, gap + (roller + flank) * direction
    start = np.arctan2(*(end - centre)[::-1])
    angles = start - np.linspace(0, 0.9, 60)
    arc = centre + flank * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    arc = arc[(np.hypot(arc[:, 0], arc[:, 1]) <= tip) & (arc[:, 1] > 0.2)]
    arc = arc[np.unique(np.linspace(0, len(arc) - 1, 6).astype(int))]
    foot = np.array([[end[0] - 0.8 * roller, end[1]]])
    upper = np.concatenate([foot, arc])
    return np.concatenate([upper * [1, -1], upper[::-1]])


def journal_roller(size: dict[str, float]) -> s.Solid:
    """A roller with a journal at each end."""
    outer, journal, width, reach = size["D_mm"] / 2, size["d_mm"] / 2, size["width_mm"], size["journal_mm"]
    c = size["chamfer_mm"]
    profile = [(0, -reach), (journal, -reach), (journal, 0), (outer - c, 0), (outer, c), (outer, width - c)]
    profile += [(outer - c, width), (journal, width), (journal, width + reach), (0, width + reach)]
    return sh.turned(profile).solid()


def grooved_roller(size: dict[str, float]) -> s.Solid:
    """A roller waisted in its middle for a tube or a rope, with a bore."""
    outer, waist, bore, top = size["D_mm"] / 2, size["waist_mm"] / 2, size["bore_mm"] / 2, size["L_mm"]
    rim = size["rim_mm"]
    side = (top - 2 * rim) / 3
    profile = [(bore, 0), (outer, 0), (outer, rim), (waist, rim + side), (waist, rim + 2 * side)]
    return sh.turned([*profile, (outer, top - rim), (outer, top), (bore, top)]).solid()


def guide_wheel(size: dict[str, float]) -> s.Solid:
    """A wheel with a V-shaped rim that runs in a groove, and a long bored hub."""
    outer, rim, hub, bore = size["D_mm"] / 2, size["rim_mm"] / 2, size["hub_mm"] / 2, size["bore_mm"] / 2
    width, top = size["width_mm"], size["L_mm"]
    profile = [(bore, 0), (rim, 0), (outer, 0.35 * width), (outer, 0.65 * width), (rim, width), (hub, width)]
    return sh.turned([*profile, (hub, top), (bore, top)]).solid()
