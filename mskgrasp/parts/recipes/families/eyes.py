"""Parts with an eye: eyebolts, eye nuts, swing bolts, shackles, turnbuckles."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.families import forms as f
from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.fasteners import Lengths, with_lengths
from mskgrasp.parts.recipes.families.listing import OWN, one_per_row
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s

SWING_BOLTS: Lengths = {
    6: (50, 70),
    8: (50, 75, 100),
    10: (45, 60, 80, 110),
    12: (60, 90, 120),
    16: (70, 100, 130),
    20: (80, 120),
    24: (100,),
}


def recipes() -> Iterator[Recipe]:
    """The built-in parts with an eye."""
    yield from one_per_row("din580_eyebolt.csv", "eyebolt_m{d1}", eyebolt, source="DIN 580")
    yield from one_per_row("din582_eye_nut.csv", "eye_nut_m{d1}", eye_nut, source="DIN 582")
    yield from with_lengths(
        "din444_swing_bolt.csv", SWING_BOLTS, "swing_bolt_m{d}x{l}", swing_bolt, "DIN 444"
    )
    yield from one_per_row("ring_bolt.csv", "ring_bolt_m{d}x{l}", ring_bolt)
    yield from one_per_row("shackle.csv", "shackle_{d}x{w}", shackle)
    yield from one_per_row(
        "turnbuckle.csv", "turnbuckle_m{d}x{l}", turnbuckle, source=f"{OWN}, like DIN 1480"
    )
    yield from one_per_row("pipe_turnbuckle.csv", "pipe_turnbuckle_m{d}x{l}", pipe_turnbuckle)


def eyebolt(size: dict[str, float]) -> s.Solid:
    """A forged ring on a collar, a short thread below z = 0."""
    return (_collared_ring(size) + f.shank(size["d1_mm"], 0, size["l_mm"]).mirrored("z")).solid()


def eye_nut(size: dict[str, float]) -> s.Solid:
    """A forged ring on a collar that is threaded from below; the hulls fill the thread."""
    thread = s.drill(size["bore_mm"] / 2, (0, 0, -1), "z", size["e_mm"] + 1)
    return _collared_ring(size).drilled(thread).solid()


def _collared_ring(size: dict[str, float]) -> h.Shape:
    """A ring in the xz-plane, a collar at z = 0 and a cone between them."""
    outer, inner, collar = size["d3_mm"] / 2, size["d4_mm"] / 2, size["d2_mm"] / 2
    rod, e = (outer - inner) / 2, size["e_mm"]
    ring = f.torus(outer - rod, rod).turned("x", 90).moved(z=size["h_mm"] - outer)
    neck = size["h_mm"] - outer - inner - 0.3 * rod
    return ring + h.turned([(0, 0), (collar, 0), (collar, 0.6 * e), (0.9 * rod, neck), (0, neck)])


def swing_bolt(size: dict[str, float]) -> s.Solid:
    """A flat eye about y at the origin and a shank along z; the length counts from the eye's centre."""
    radius, pin, half = size["d3_mm"] / 2, size["d2_mm"] / 2, size["s_mm"] / 2
    # A ball between two flats, as it is turned: the rim is narrower than the eye is in the middle.
    rim, height = 0.72 * half, 0.88 * radius
    eye = h.turned(
        [(pin, -half), (height, -half), (radius, -rim), (radius, rim), (height, half), (pin, half)]
    )
    # The shank starts in the eye's wall, not in its bore.
    return (eye.turned("x", 90) + f.shank(size["d_mm"], (pin + radius) / 2, size["l_mm"])).solid()


def ring_bolt(size: dict[str, float]) -> s.Solid:
    """A ring of round bar welded to a threaded shank, with a nut on it."""
    rod, inner, length, nut = size["d_mm"] / 2, size["inner_mm"] / 2, size["l_mm"], size["nut_mm"]
    ring = f.torus(inner + rod, rod).turned("x", 90)
    start = inner + rod
    hexagon = h.hexagon_bar(size["s_mm"], nut, nut + 0.8 * size["d_mm"])
    return (ring + hexagon + f.shank(size["d_mm"], start, start + length)).solid()


def shackle(size: dict[str, float]) -> s.Solid:
    """A bow of round bar with an eye at either end, and the pin with its collar through both."""
    rod, half, depth, pin = size["d_mm"] / 2, size["w_mm"] / 2, size["depth_mm"], size["pin_mm"] / 2
    leg = depth - half
    bend = half + rod
    bow = f.bent_rod(rod, leg, (bend, 180.0), leg).turned("z", 90).moved(x=bend)
    eyes = h.cylinder(1.25 * pin + rod / 2, half, half + 2 * rod).turned("y", 90)
    head = h.cylinder(1.2 * pin, half, half + 2 * rod + 1.2 * pin).turned("y", 90)
    bolt = h.cylinder(pin, -half - 2 * rod - 0.4 * pin, half + 2 * rod).turned("y", 90)
    return (bow + eyes + eyes.mirrored("x") + bolt + head).solid()


def turnbuckle(size: dict[str, float]) -> s.Solid:
    """An open body along z: two threaded hubs joined by two bars."""
    half, hub, bore = size["l_mm"] / 2, size["hub_mm"] / 2, size["d1_mm"] / 2
    bar, end = size["bar_mm"] / 2, size["hub_length_mm"]
    near = hub - 0.5 * bar
    # Each bar reaches into the hubs' walls and stays clear of the threads.
    sections = s.balanced_polygon(bar, 10)
    x0, z0 = max(near, bore + bar + 0.5), half - 0.6 * end
    rods = h.tool(
        s.extrude(s.circle(bar), -z0, z0), [s.prism(sections, -z0, 0), s.prism(sections, 0, z0)]
    ).moved(x=x0)
    sleeve = h.tool(
        s.extrude(s.circle(hub), half - end, half, [s.circle(bore)]), o.hollow(bore, hub, half - end, half)
    )
    return (sleeve + sleeve.mirrored("z") + rods + rods.mirrored("x")).solid()


def pipe_turnbuckle(size: dict[str, float]) -> s.Solid:
    """A closed body along z: a tube with a threaded hexagon at either end and a hole across the middle."""
    half, tube, bore, end = size["l_mm"] / 2, size["D_mm"] / 2, size["d1_mm"] / 2, size["end_mm"]
    across = s.drill(size["hole_mm"] / 2, (0, -tube - 1, 0), "y", 2 * tube + 2)
    wall = size["wall_mm"]
    shell = h.tool(
        s.extrude(s.circle(tube), -half + end, half - end, [s.circle(tube - wall)]),
        o.hollow(tube - wall, tube, -half + end, half - end),
    ).drilled(across)
    hexagon = f.hex_ring(size["s_mm"], bore, half - end, half)
    return (shell + hexagon + hexagon.mirrored("z")).solid()
