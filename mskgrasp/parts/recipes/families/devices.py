"""Electrical and thermal parts: heat sinks, motors, solenoids, relays, terminal blocks, enclosures."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import POLYAMIDE, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s

MOTOR = 3900.0
"""Density of a stepper motor's envelope, kg/m^3: a NEMA 17 motor of 40 mm then has its usual 0.28 kg."""

COIL = 5500.0
"""Mean density of iron, copper and air in a coil's frame, kg/m^3."""

ENCAPSULATED = 1600.0
"""Mean density of a moulded housing with contacts in it, kg/m^3."""


def recipes() -> Iterator[Recipe]:
    """The built-in devices."""
    yield from one_per_row("heat_sink.csv", "heat_sink_{a}x{b}x{l}", heat_sink, density=ALUMINIUM)
    yield from one_per_row("stepper_motor.csv", "stepper_motor_{size}x{l}", stepper_motor, density=MOTOR)
    yield from one_per_row("gearmotor.csv", "gearmotor_{d}x{l}", gearmotor, density=MOTOR)
    yield from one_per_row("solenoid.csv", "solenoid_{a}x{b}x{l}", solenoid, density=COIL)
    yield from one_per_row("relay.csv", "relay_{a}x{b}x{c}", relay, density=ENCAPSULATED)
    yield from one_per_row(
        "terminal_block.csv", "terminal_block_{a}x{b}x{w}", terminal_block, density=ENCAPSULATED
    )
    yield from one_per_row("rail_clip.csv", "rail_clip_{l}x{w}", rail_clip, density=POLYAMIDE)
    yield from one_per_row(
        "connector_shell.csv", "connector_shell_{a}x{b}x{l}", connector_shell, density=POLYAMIDE
    )
    yield from one_per_row("enclosure.csv", "enclosure_{a}x{b}x{c}", enclosure, density=POLYAMIDE)
    yield from one_per_row("transformer.csv", "transformer_{a}x{b}x{c}", transformer, density=COIL)


def heat_sink(size: dict[str, float]) -> s.Solid:
    """A base with straight fins along x."""
    a, b, length, base = size["a_mm"], size["b_mm"], size["l_mm"], size["base_mm"]
    fins, t = int(size["fins"]), size["fin_mm"]
    shape = h.block(0, length, 0, a, 0, base)
    for n in range(fins):
        y = (a - t) * n / (fins - 1)
        shape += h.block(0, length, y, y + t, 0, b)
    return shape.solid()


def stepper_motor(size: dict[str, float]) -> s.Solid:
    """A square body along z with blunt edges, a pilot, a shaft; the end bells have the blunter edges."""
    half, length, cut = size["a_mm"] / 2, size["l_mm"], size["cut_mm"]
    bell = 0.22 * length
    body = h.plate(o.blunted(-half, half, -half, half, 2 * cut), 0, bell)
    body += h.plate(o.blunted(-half, half, -half, half, 2 * cut), length - bell, length)
    lamination = half - 0.4
    body += h.plate(
        o.blunted(-lamination, lamination, -lamination, lamination, 3.4 * cut),
        bell - 0.1,
        length - bell + 0.1,
    )
    reach = size["spacing_mm"] / 2
    for x in (-reach, reach):
        for y in (-reach, reach):
            body = body.drilled(s.drill(size["hole_mm"] / 2, (x, y, length - 4.5), "z", 6))
    pilot = h.cylinder(size["pilot_mm"] / 2, length - 0.1, length + size["high_mm"])
    return (body + pilot + h.cylinder(size["shaft_mm"] / 2, length, length + size["stub_mm"])).solid()


def gearmotor(size: dict[str, float]) -> s.Solid:
    """A motor can along z, a wider gearbox on it with an eccentric pilot, an output shaft."""
    can, box, length, gear = size["d_mm"] / 2, size["box_mm"] / 2, size["l_mm"], size["gear_mm"]
    off, shaft = size["off_mm"], size["shaft_mm"] / 2
    motor = h.turned(
        [(0, -2), (0.3 * can, -2), (0.3 * can, 0), (can, 0), (can, length - gear), (0, length - gear)]
    )
    gearbox = h.cylinder(box, length - gear - 0.1, length)
    pilot = h.cylinder(1.9 * shaft, length - 0.1, length + 3).moved(x=off)
    return (
        motor + gearbox + pilot + h.cylinder(shaft, length, length + size["stub_mm"]).moved(x=off)
    ).solid()


def solenoid(size: dict[str, float]) -> s.Solid:
    """A frame of bent sheet along x about a round coil, a plunger that comes out of one end."""
    a, b, length, t = size["a_mm"] / 2, size["b_mm"], size["l_mm"], size["t_mm"]
    frame = (
        h.block(0, length, -a, a, 0, t)
        + h.block(0, t, -a, a, 0, b)
        + h.block(length - t, length, -a, a, 0, b)
    )
    coil = min(a, (b - t) / 2) * 0.96
    middle = (b + t) / 2
    wound = h.cylinder(coil, t - 0.1, length - t + 0.1).turned("y", 90).moved(z=middle)
    plunger = h.cylinder(size["plunger_mm"] / 2, length - 0.1, length + size["out_mm"]).turned("y", 90)
    pin = s.drill(0.2 * size["plunger_mm"], (length + 0.7 * size["out_mm"], -a, middle), "y", 2 * a)
    return (frame + wound + plunger.moved(z=middle).drilled(pin)).solid()


def relay(size: dict[str, float]) -> s.Solid:
    """A moulded box with blade terminals below and a mounting tab at one end."""
    a, b, c = size["a_mm"] / 2, size["b_mm"] / 2, size["c_mm"]
    pins, blade, tab = int(size["pins"]), size["blade_mm"], size["tab_mm"]
    shape = h.block(-a, a, -b, b, 0, c)
    if tab:
        ear = h.block(a - 0.1, a + tab, -0.6 * b, 0.6 * b, 0.75 * c, 0.75 * c + 2.5)
        shape += ear.drilled(s.drill(0.25 * tab, (a + 0.5 * tab, 0, 0.7 * c), "z", 5))
    for n in range(pins):
        x = a * (2 * (n + 0.5) / pins - 1)
        shape += h.block(x - 0.5, x + 0.5, -0.35 * b, 0.35 * b, -blade, 0.1)
    return shape.solid()


def terminal_block(size: dict[str, float]) -> s.Solid:
    """A slice for a mounting rail: shoulders that step down, a recess for the 35 mm rail with two hooks."""
    a, b, w = size["a_mm"] / 2, size["b_mm"], size["w_mm"] / 2
    shoulder, foot = size["shoulder_mm"], 6.0
    right = [(21.0, 0), (21, foot), (a, foot), (a, b - shoulder), (0.62 * a, b - shoulder), (0.5 * a, b)]
    recess = [(17.8, foot), (17.8, 2.2), (15.5, 0)]
    outline = o.mirrored([*recess, *right])
    return o.along_y(outline, -w, w).solid()


def rail_clip(size: dict[str, float]) -> s.Solid:
    """A foot that snaps on a 35 mm rail: a bar along x with a hook at either end, one of them springy."""
    length, w, t, hook = size["l_mm"], size["w_mm"] / 2, size["t_mm"], size["hook_mm"]
    rail = (length - 35.6) / 2
    bar = h.block(0, length, -w, w, 0, t)
    ends = o.along_y(
        [(0, -hook), (rail + 2, -hook), (rail + 2, 1 - hook), (rail, 2 - hook), (rail, 0.1), (0, 0.1)], -w, w
    )
    far = ends.mirrored("x").moved(x=length)
    lever = h.block(length - 0.1, length + size["lever_mm"], -0.6 * w, 0.6 * w, -hook, 1.5 - hook)
    hole = s.drill(size["hole_mm"] / 2, (length / 2, 0, -1), "z", t + 2)
    return (bar.drilled(hole) + ends + far + lever).solid()


def connector_shell(size: dict[str, float]) -> s.Solid:
    """A housing open at one end, a thicker grip with ribs behind, a latch above."""
    a, b, length, t = size["a_mm"] / 2, size["b_mm"] / 2, size["l_mm"], size["t_mm"]
    front = 0.5 * length
    hood = o.pierced(s.rectangle(-a, a, -b, b), front, length, [s.rectangle(t - a, a - t, t - b, b - t)])
    grip = h.block(-a - 1.5, a + 1.5, -b - 1.5, b + 1.5, 0, front + 0.1)
    for z in (0.12, 0.24, 0.36):
        for side in (-1, 1):
            x = side * (a + 1.5)
            grip += h.block(min(x, x + side), max(x, x + side), -b, b, z * length, z * length + 2)
    latch = h.block(-0.3 * a, 0.3 * a, b - 0.1, b + 3, front, 0.82 * length)
    return (hood + grip + latch).solid()


def enclosure(size: dict[str, float]) -> s.Solid:
    """An open box with screw bosses in its corners and a cable hole through one end."""
    a, b, c, t = size["a_mm"] / 2, size["b_mm"] / 2, size["c_mm"], size["t_mm"]
    boss, hole = size["boss_mm"], size["hole_mm"] / 2
    floor = h.block(-a, a, -b, b, 0, t)
    walls = o.pierced(s.rectangle(-a, a, -b, b), 0, c, [s.rectangle(t - a, a - t, t - b, b - t)])
    box = (floor + walls).drilled(s.drill(hole, (-a - 1, 0, 0.55 * c), "x", t + 2))
    for x in (-a, a - boss - t):
        for y in (-b, b - boss - t):
            post = h.block(x + 0.1, x + boss + t - 0.1, y + 0.1, y + boss + t - 0.1, 0, c - 3)
            box += post.drilled(
                s.drill(0.25 * boss, (x + (boss + t) / 2, y + (boss + t) / 2, c - 12), "z", 12)
            )
    return box.solid()


def transformer(size: dict[str, float]) -> s.Solid:
    """A laminated core with a winding through its two windows, and a foot with a slot at either end."""
    a, b, c, coil = size["a_mm"] / 2, size["b_mm"] / 2, size["c_mm"], size["coil_mm"] / 2
    foot, t = size["foot_mm"], 2.5
    core = h.block(-a, a, -b, b, 0, c)
    winding = h.block(-0.62 * a, 0.62 * a, -coil, coil, 0.2 * c, 0.8 * c)
    feet = h.block(-a - foot, a + foot, -0.6 * b, 0.6 * b, 0, t)
    for x in (a + 0.5 * foot, -a - 0.5 * foot):
        feet = feet.drilled(s.drill(min(2.2, 0.25 * foot), (x, 0, -1), "z", t + 2))
    return (core + winding + feet).solid()
