"""Heads and joints of rods: fork heads, rod ends, angle joints; connecting rods and levers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts.recipes.families import outlines as o
from mskgrasp.parts.recipes.families.listing import CAST_IRON, one_per_row
from mskgrasp.parts.recipes.recipe import ALUMINIUM, Recipe
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in joints and levers."""
    yield from one_per_row("din71752_clevis.csv", "clevis_{d1}x{g}", clevis, source="DIN 71752")
    yield from one_per_row(
        "iso12240_rod_end.csv", "rod_end_male_{d}", rod_end, source="ISO 12240-4, series K", family="rod_end"
    )
    yield from one_per_row(
        "iso12240_rod_end_female.csv",
        "rod_end_female_{d}",
        rod_end_female,
        source="ISO 12240-4, series K",
        family="rod_end",
    )
    yield from one_per_row("angle_joint.csv", "angle_joint_{d}x{l}", angle_joint)
    yield from one_per_row("connecting_rod.csv", "connecting_rod_{p}x{big}", connecting_rod)
    yield from one_per_row("hub_lever.csv", "hub_lever_{p}x{hub}", hub_lever, density=CAST_IRON)
    yield from one_per_row("bell_crank.csv", "bell_crank_{p}x{q}x{angle}", bell_crank, density=ALUMINIUM)
    yield from one_per_row("rocker_arm.csv", "rocker_arm_{p}x{hub}", rocker_arm)
    yield from one_per_row("toggle_arm.csv", "toggle_arm_{l}x{w}", toggle_arm)


def clevis(size: dict[str, float]) -> s.Solid:
    """A square fork along z, its round neck below, a thread's bore up to the slot, the pin's bore along x."""
    a, b, g, pin = size["a_mm"] / 2, size["b_mm"] / 2, size["g_mm"], size["d1_mm"] / 2
    neck, l1, l2, thread = size["d3_mm"] / 2, size["l1_mm"], size["l2_mm"], size["d2_mm"] / 2
    floor = l2 - g
    start = 0.55 * floor  # of the neck, which the table leaves open
    fork = h.block(-a, a, -a, a, start, l1) - h.block(-b, b, -a - 1, a + 1, floor, l1 + 1)
    shape = h.cylinder(neck, 0, start + 0.2) + fork
    thread_hole = o.bore(0.85 * thread, -1, floor + 1)
    pin_hole = o.bore(pin, -a - 1, a + 1).turned("y", 90).moved(z=l2)
    return (shape - thread_hole - pin_hole).solid()


def rod_end(size: dict[str, float]) -> s.Solid:
    """A ring with a ball along y and a threaded shank downward; the ball's bore is kept."""
    d, ball, head, d2 = size["d_mm"] / 2, size["B_mm"] / 2, size["C1_mm"] / 2, size["d2_mm"] / 2
    h1, thread = size["h1_mm"], size["G_mm"] / 2
    shank = h.cylinder(thread, -h1, -0.8 * d2)
    return (_eye(d, ball, head, d2) + shank).solid()


def rod_end_female(size: dict[str, float]) -> s.Solid:
    """A ring with a ball along y and a shank with a threaded bore downward."""
    d, ball, head, d2 = size["d_mm"] / 2, size["B_mm"] / 2, size["C1_mm"] / 2, size["d2_mm"] / 2
    h1, bore, neck = size["h_mm"], 0.425 * size["G_mm"], 0.8 * size["G_mm"]
    deep = 0.7 * (h1 - d2)
    shank = h.cylinder(neck, -h1, -0.8 * d2)
    hole = o.bore(bore, -h1 - 1, deep - h1)
    return (_eye(d, ball, head, d2) + (shank.drilled(hole) if bore < 2.8 else shank - hole)).solid()


def angle_joint(size: dict[str, float]) -> s.Solid:
    """A socket along x that holds a ball stud, whose threaded end stands along z."""
    d, length, socket, shank = size["d_mm"] / 2, size["l_mm"], size["socket_mm"] / 2, size["shank_mm"] / 2
    high, stud = size["h_mm"], size["stud_mm"] / 2
    cup = h.cylinder(socket, -0.9 * socket, 0.9 * socket)
    arm = h.cylinder(shank, 0, length).turned("y", 90)
    pin = h.cylinder(stud, 0, high) + h.hexagon_bar(3.4 * stud, 1.25 * socket, 1.25 * socket + 1.2 * stud)
    return (cup + arm.drilled(s.drill(0.84 * d, (length - 3 * d, 0, 0), "x", length)) + pin).solid()


def connecting_rod(size: dict[str, float]) -> s.Solid:
    """A big eye and a small one, joined by a tapering shank that is thinner than they are."""
    p, big, small = size["p_mm"], size["big_mm"] / 2, size["small_mm"] / 2
    w, web = size["w_mm"] / 2, size["web_mm"] / 2
    eyes = o.tube(big, size["bore_mm"] / 2, -w, w), o.tube(small, size["pin_mm"] / 2, -w, w).moved(x=p)
    hulls = o.hollow(size["bore_mm"] / 2, big, -w, w)
    hulls += [points + [p, 0, 0] for points in o.hollow(size["pin_mm"] / 2, small, -w, w)]
    eyes = h.tool(eyes[0].body + eyes[1].body, hulls)
    x0, x1, y0, y1 = 0.88 * big, p - 0.88 * small, 0.46 * big, 0.46 * small
    shank = h.plate(np.array([[x0, -y0], [x1, -y1], [x1, y1], [x0, y0]]), -web, web)
    return (eyes + shank).solid()


def hub_lever(size: dict[str, float]) -> s.Solid:
    """A tall hub for a shaft, an arm, an eye for a pin at its end."""
    p, hub, eye, high = size["p_mm"], size["hub_mm"] / 2, size["eye_mm"] / 2, size["h_mm"]
    t, bore, pin = size["t_mm"], size["bore_mm"] / 2, size["pin_mm"] / 2
    outline = o.belt((0, 0, 0.8 * hub), (p, 0, eye))
    arm = h.plate(outline, 0, t) - h.tool(Manifold(), [s.prism(s.bore_polygon(0.9 * hub), -1, t + 1)])
    body = arm.body + s.extrude(s.circle(hub), 0, high) - s.extrude(s.circle(bore), -1, high + 1)
    lever = h.tool(body, [*arm.hulls, *o.hollow(bore, hub, 0, high)])
    return lever.drilled(s.drill(pin, (p, 0, -1), "z", t + 2)).solid()


def bell_crank(size: dict[str, float]) -> s.Solid:
    """A hub with two arms at an angle in degrees, a pin's hole at the end of each."""
    p, q, angle = size["p_mm"], size["q_mm"], np.radians(size["angle"])
    hub, eye, t, high = size["hub_mm"] / 2, size["eye_mm"] / 2, size["t_mm"], size["h_mm"]
    bore, pin = size["bore_mm"] / 2, size["pin_mm"] / 2
    ends = [(p, 0.0), (float(q * np.cos(angle)), float(q * np.sin(angle)))]
    hole = h.tool(Manifold(), [s.prism(s.bore_polygon(0.9 * hub), -1, t + 1)])
    body, hulls = s.extrude(s.circle(hub), 0, high), o.hollow(bore, hub, 0, high)
    for x, y in ends:
        arm = h.plate(o.belt((0, 0, 0.7 * hub), (x, y, eye)), 0, t)
        body, hulls = body + arm.body, [*hulls, *(arm - hole).hulls]
    crank = h.tool(body - s.extrude(s.circle(bore), -1, high + 1), hulls)
    return crank.drilled(*(s.drill(pin, (x, y, -1), "z", t + 2) for x, y in ends)).solid()


def rocker_arm(size: dict[str, float]) -> s.Solid:
    """A tube for the axle in the middle, an arm to either side that sinks to its end; the ends have pads."""
    p, q, hub, w = size["p_mm"], size["q_mm"], size["hub_mm"] / 2, size["w_mm"] / 2
    bore, t, drop = size["bore_mm"] / 2, size["t_mm"] / 2, size["drop_mm"]
    tube = h.tool(o.tube(hub, bore, -w, w).body, o.hollow(bore, hub, -w, w))
    for x in (p, -q):
        root, pad = 0.86 * hub * np.sign(x), 0.25 * hub
        outline = np.array([[root, -0.5 * hub], [x, -drop - pad], [x, -drop + pad], [root, 0.5 * hub]])
        tube += h.plate(outline, -t, t)
        tube += h.plate(s.polygon(1.4 * pad, 12) + [x, -drop], -1.4 * t, 1.4 * t)
    return tube.turned("x", 90).solid()


def toggle_arm(size: dict[str, float]) -> s.Solid:
    """The holding arm of a toggle clamp: two bars along x with a gap, joined by a root with two bores."""
    length, w, t, gap = size["l_mm"], size["w_mm"] / 2, size["t_mm"], size["gap_mm"] / 2
    root, bore = size["root_mm"], size["bore_mm"] / 2
    bars = h.block(root, length, -w, -gap, 0, t) + h.block(root, length, gap, w, 0, t)
    tongue = h.block(0, root, -w, w, 0, t) + h.block(length - 3, length, -w, w, 0, t)
    arm = bars + tongue
    for x in (0.25 * root, 0.75 * root):
        arm = arm.drilled(s.drill(bore, (x, -w - 1, t / 2), "y", 2 * w + 2))
    return arm.solid()


def _eye(d: float, ball: float, head: float, d2: float) -> h.Shape:
    """The ring of a rod end about y, the ball in it a little wider."""
    inner = 0.66 * d2
    # The ball's barrel: its faces are where the sphere of radius ``inner`` is cut at half its width.
    face = max(np.sqrt(inner**2 - ball**2) if inner > ball else 0.0, 1.12 * d)
    core = h.turned([(d, -ball), (face, -ball), (inner, -head), (inner, head), (face, ball), (d, ball)])
    ring = h.tool(o.tube(d2, 0.9 * inner, -head, head).body, o.collar(d, inner, d2, -head, head))
    return (core + ring).turned("x", 90)
