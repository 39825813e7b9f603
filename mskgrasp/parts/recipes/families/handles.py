"""Handles to pull, push and turn by: machine handles, bow and pull handles, levers and cranks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import CAST_IRON, OWN, POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in handles; sizes are within the range of catalogues."""
    yield from one_per_row(
        "machine_handle.csv", "machine_handle_{D}x{l}", machine_handle, source=f"{OWN}, like DIN 39"
    )
    yield from one_per_row("cylinder_grip.csv", "cylinder_grip_{D}x{l}", cylinder_grip, density=POLYAMIDE)
    yield from one_per_row("bow_handle.csv", "bow_handle_{a}x{b}x{w}", bow_handle, density=POLYAMIDE)
    yield from one_per_row("pull_handle.csv", "pull_handle_{d}x{a}", pull_handle, density=ALUMINIUM)
    yield from one_per_row("bridge_handle.csv", "bridge_handle_{a}x{b}", bridge_handle, density=ALUMINIUM)
    yield from one_per_row("ball_lever.csv", "ball_lever_{l}x{ball}", ball_lever)
    yield from one_per_row(
        "clamping_lever.csv", "clamping_lever_{L}xm{d}x{l}", clamping_lever, density=ALUMINIUM
    )
    yield from one_per_row("flat_lever.csv", "flat_lever_{L}x{hub}", flat_lever, density=CAST_IRON)
    yield from one_per_row("crank.csv", "crank_{L}x{hub}", crank, density=ALUMINIUM)


def machine_handle(size: dict[str, float]) -> s.Solid:
    """A bulging grip with a collar, and a stud below z = 0."""
    radius, length, collar = size["D_mm"] / 2, size["l_mm"], size["collar_mm"] / 2
    # Slim above the collar, thickest at two thirds of its length, round at the end.
    waist, thick = 0.16 * length, 0.68 * length
    rise = np.linspace(0, 1, 12)
    flank = [
        (0.62 * radius + 0.38 * radius * (1 - np.cos(np.pi * t)) / 2, waist + (thick - waist) * t)
        for t in rise
    ]
    angles = np.linspace(0, np.pi / 2, 16)[1:]
    cap = [(radius * np.cos(a), thick + (length - thick) * np.sin(a)) for a in angles[:-1]]
    foot = [(0.0, 0.0), (collar, 0.0), (collar, 0.06 * length)]
    profile = [*foot, *((float(x), float(z)) for x, z in [*flank, *cap]), (0.0, length)]
    return (h.turned(profile) + f.shank(size["d_mm"], 0, size["stud_mm"]).mirrored("z")).solid()


def cylinder_grip(size: dict[str, float]) -> s.Solid:
    """A slightly tapering round grip with three grooves, on a bolt."""
    low, length, groove = size["D_mm"] / 2, size["l_mm"], size["groove_mm"]
    high = 0.88 * low
    profile = [(0.0, 0.0), (low - 1, 0.0), (low, 1.0)]
    for n in range(3):
        z = length * (0.25 + 0.25 * n)
        r = low + (high - low) * z / length
        profile += [
            (r, z - groove),
            (r - groove, z - 0.4 * groove),
            (r - groove, z + 0.4 * groove),
            (r, z + groove),
        ]
    profile += [(high, length - 3.0), (high - 3.0, length), (0.0, length)]
    return (h.turned(profile) + f.shank(size["d_mm"], 0, size["stud_mm"]).mirrored("z")).solid()


def bow_handle(size: dict[str, float]) -> s.Solid:
    """A moulded bow over two feet, its sides leaning inward; the screw holes stay out of the hulls."""
    half, height, width, t = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2, size["t_mm"]
    foot = size["foot_mm"]
    outer = [(-half, 0), (half, 0), (0.8 * half, height), (-0.8 * half, height)]
    corner = 0.3 * height
    # The opening goes on below the feet, so that only its upper corners come out round.
    low, top = half - foot + 0.2 * half * corner / (height - t), 0.8 * half - foot
    inner = [(-low, -corner), (low, -corner), (top, height - t), (-top, height - t)]
    region = _rounded(outer, corner).intersection(shapely.box(-half, 0, half, height))
    region = region.union(shapely.Polygon([*outer[:2], (0.9 * half, height / 2), (-0.9 * half, height / 2)]))
    region = region.difference(_rounded(inner, 0.5 * corner))
    bow = o.along_y(np.asarray(shapely.get_coordinates(region))[:-1], -width, width)
    holes = [
        s.drill(size["hole_mm"] / 2, (x, 0, -1), "z", 0.5 * height)
        for x in (foot / 2 - half, half - foot / 2)
    ]
    return bow.drilled(*holes).solid()


def _rounded(corners: list[tuple[float, float]], radius: float) -> shapely.Polygon:
    shape = shapely.Polygon(corners).buffer(-radius, join_style="mitre").buffer(radius, quad_segs=12)
    assert isinstance(shape, shapely.Polygon)
    return shape


def pull_handle(size: dict[str, float]) -> s.Solid:
    """A bent round bar between two round flanges."""
    r, half, height, bend = size["d_mm"] / 2, size["a_mm"] / 2, size["b_mm"], size["bend_mm"]
    leg, bridge = height - bend - r, 2 * (half - bend)
    bar = (
        f.bent_rod(r, leg, (bend, 90.0), bridge, (bend, 90.0), leg)
        .turned("z", 90)
        .moved(x=half)
        .turned("x", 90)
    )
    flange = h.turned(
        [
            (0, 0),
            (size["flange_mm"] / 2, 0),
            (size["flange_mm"] / 2, 3),
            (size["flange_mm"] / 2 - 2, 5),
            (0, 5),
        ]
    )
    return (bar + flange.moved(x=half) + flange.moved(x=-half)).solid()


def bridge_handle(size: dict[str, float]) -> s.Solid:
    """A straight round bar held by two posts with rounded ends."""
    r, half, height, post = size["d_mm"] / 2, size["a_mm"] / 2, size["b_mm"], size["post_mm"] / 2
    bar = h.cylinder(r, -half, half).turned("y", 90).moved(z=height - r)
    wide = 1.35 * r
    foot = h.block(-post, post, -wide, wide, 0, height - r)
    foot += h.cylinder(wide, -post, post).turned("y", 90).moved(z=height - r)
    feet = [foot.moved(x=x) for x in (size["pitch_mm"] / 2, -size["pitch_mm"] / 2)]
    return (bar + feet[0] + feet[1]).solid()


def ball_lever(size: dict[str, float]) -> s.Solid:
    """A tapering rod that rises from a hub with a bore and ends in a ball."""
    length, ball, hub, thick = (
        size["l_mm"],
        size["ball_mm"] / 2,
        size["hub_mm"] / 2,
        size["hub_height_mm"] / 2,
    )
    rod, bore = size["rod_mm"] / 2, size["bore_mm"] / 2
    arm = h.turned([(0.0, 0.0), (rod, 0.0), (0.7 * rod, length), (0.0, length)])
    end = h.turned(f.arc(ball, 0.0, -90, 90, count=24)).moved(z=length)
    lever = (arm.moved(z=0) + end).turned("y", 75)
    eye = o.tube(hub, bore, -thick, thick)
    # The rod starts in the hub's wall, not in its bore.
    return (eye + (lever.moved(x=0.6 * (hub + bore)) - h.cylinder(bore, -thick, thick))).solid()


def clamping_lever(size: dict[str, float]) -> s.Solid:
    """A hub with a stud below and an arm that rises from it, broad at its end."""
    length, hub, total = size["L_mm"], size["hub_mm"] / 2, size["hub_height_mm"]
    t, tip = size["t_mm"] / 2, size["tip_mm"] / 2
    post = h.turned(
        [(0, 0), (0.8 * hub, 0), (hub, 0.6 * total), (hub, total - 2), (hub - 2, total), (0, total)]
    )
    discs = (0, 0, 0.75 * hub), (0.55 * length, 0, 0.5 * tip), (length - tip, 0, tip)
    arm = f.arm(-t, t, *discs).turned("y", -15).moved(z=total - 1.2 * t)
    return (post + arm + f.shank(size["d_mm"], 0, size["l_mm"]).mirrored("z")).solid()


def flat_lever(size: dict[str, float]) -> s.Solid:
    """A cast lever: a bored hub, a flat tapering arm, a round end with a hole."""
    length, hub, bore, end = size["L_mm"], size["hub_mm"] / 2, size["bore_mm"] / 2, size["end_mm"] / 2
    thick, t = size["hub_height_mm"] / 2, size["t_mm"] / 2
    arm = f.arm(-t, t, (0, 0, 0.7 * hub), (length, 0, 0.6 * end)) - o.bore((hub + bore) / 2, -t, t)
    eye = o.tube(end, size["hole_mm"] / 2, -0.7 * thick, 0.7 * thick).moved(x=length)
    hole = o.bore((end + size["hole_mm"] / 2) / 2, -t, t).moved(x=length)
    return (o.tube(hub, bore, -thick, thick) + (arm - hole) + eye).solid()


def crank(size: dict[str, float]) -> s.Solid:
    """A hub, a flat arm and an upright round handle at its end."""
    length, hub, bore, t = size["L_mm"], size["hub_mm"] / 2, size["bore_mm"] / 2, size["t_mm"]
    grip, rise = size["grip_mm"] / 2, size["grip_length_mm"]
    arm = f.arm(0, t, (0, 0, hub), (length, 0, 0.8 * grip + 2)) - o.bore(bore, 0, t)
    eye = o.tube(hub, bore, -0.8 * t, t)
    foot = [(0.0, t), (0.7 * grip, t), (0.7 * grip, t + 3), (grip, t + 6), (grip, t + rise - 5)]
    handle = h.turned([*foot, (0.7 * grip, t + rise), (0.0, t + rise)]).moved(x=length)
    return (arm + eye + handle).solid()
