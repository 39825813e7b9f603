"""Shaft couplings and clamp collars."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from mskgrasp.parts.recipes.families.listing import OWN, POLYOXYMETHYLENE, POLYURETHANE, one_per_row
from mskgrasp.parts.recipes.families.rings import bolt_circle, groove, tube
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

SLOT = 2.0
"""Width of the slots of clamps, mm; hulls fill them."""


def recipes() -> Iterator[Recipe]:
    """The built-in couplings and clamp collars; none follows a standard in every dimension."""
    for file_name, name, make, density, source in (
        ("sleeve_coupling.csv", "sleeve_coupling_{D}x{d}x{L}", sleeve_coupling, STEEL, OWN),
        ("clamp_coupling.csv", "clamp_coupling_{D}x{d}x{L}", clamp_coupling, ALUMINIUM, OWN),
        ("jaw_hub.csv", "jaw_hub_{D}x{d}x{L}", jaw_hub, ALUMINIUM, OWN),
        ("jaw_spider.csv", "jaw_spider_{D}x{t}", jaw_spider, POLYURETHANE, OWN),
        ("oldham_hub.csv", "oldham_hub_{D}x{L}", oldham_hub, ALUMINIUM, OWN),
        ("oldham_disc.csv", "oldham_disc_{D}x{t}", oldham_disc, POLYOXYMETHYLENE, OWN),
        ("flange_coupling.csv", "flange_coupling_{D}x{d}x{L}", flange_coupling, STEEL, OWN),
        ("bellows_coupling.csv", "bellows_coupling_{D}x{L}", bellows_coupling, ALUMINIUM, OWN),
        ("beam_coupling.csv", "beam_coupling_{D}x{L}", beam_coupling, ALUMINIUM, OWN),
        ("clamp_collar.csv", "clamp_collar_{D}x{d}x{b}", clamp_collar, STEEL, OWN),
        ("two_piece_collar.csv", "two_piece_collar_{D}x{d}x{b}", two_piece_collar, ALUMINIUM, OWN),
        ("boss_collar.csv", "boss_collar_{D}x{d}x{b}", boss_collar, STEEL, OWN),
        ("hub_collar.csv", "hub_collar_{flange}x{d}x{L}", hub_collar, ALUMINIUM, OWN),
    ):
        yield from one_per_row(file_name, name, make, density=density, source=source)


def sleeve_coupling(size: dict[str, float]) -> s.Solid:
    """A rigid sleeve with two set screws at each end and chamfered edges."""
    outer, bore, top, r = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"], size["screw_mm"] / 2
    body = sh.turned([(bore, 0), (outer - 1, 0), (outer, 1), (outer, top - 1), (outer - 1, top), (bore, top)])
    places = [share * top for share in (0.12, 0.32, 0.68, 0.88)]
    return body.drilled(*(s.drill(r, (0, 0, z), "x", outer + 1) for z in places)).solid()


def clamp_coupling(size: dict[str, float]) -> s.Solid:
    """A sleeve slotted along one side, with clamp screws across the slot."""
    outer, bore, top = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"]
    slot = sh.block(0, outer + 1, -SLOT / 2, SLOT / 2, -1, top + 1)
    heights = top * (np.arange(int(size["screws"])) + 0.5) / size["screws"]
    return (
        tube(outer, bore, 0, top)
        .drilled(slot, *_clamp_screws(outer, bore, size["screw_mm"], heights))
        .solid()
    )


def _clamp_screws(outer: float, bore: float, screw: float, heights: np.ndarray) -> list[Manifold]:
    """Holes across a slot at +x, widened for the screw's head on the side of -y."""
    x = (outer + bore) / 2
    reach, head = np.sqrt(outer**2 - x**2) + 1, 0.9 * screw
    holes = []
    for z in heights:
        holes.append(s.drill(screw / 2, (x, -reach, z), "y", 1.7 * reach))
        holes.append(s.drill(head, (x, -outer - 1, z), "y", outer + 1 - 0.55 * reach))
    return holes


def jaw_hub(size: dict[str, float]) -> s.Solid:
    """Half of a jaw coupling: a bored hub with three (or two) jaws above and a set screw."""
    outer, bore, top, jaws = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"], int(size["jaws"])
    inner, reach = 0.45 * outer, top - size["jaw_mm"]
    body = tube(outer, bore, 0, reach)
    half = np.degrees(0.42 * np.pi / jaws)
    for number in range(jaws):
        jaw = _sector(inner, outer, half, reach - 0.5, top)
        body = body + jaw.turned("z", 360 * number / jaws)
    screw = s.drill(size["screw_mm"] / 2, (0, 0, 0.4 * reach), "x", outer + 1)
    return body.drilled(screw).solid(merge=False)


def _sector(inner: float, outer: float, half_degrees: float, z0: float, z1: float) -> sh.Shape:
    """A piece of a ring about +x; its inner side is straight."""
    body = []
    for steps in (24, 6):
        angles = np.radians(np.linspace(-half_degrees, half_degrees, steps + 1))
        arc = outer * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        chord = inner * np.stack([np.cos(angles[[-1, 0]]), np.sin(angles[[-1, 0]])], axis=1)
        body.append(np.concatenate([arc, chord]))
    return sh.tool(s.extrude(body[0], z0, z1), [s.prism(body[1], z0, z1)])


def jaw_spider(size: dict[str, float]) -> s.Solid:
    """The elastic star of a jaw coupling: a ring with crowned arms."""
    outer, bore, t, arms = size["D_mm"] / 2, size["d_mm"] / 2, size["t_mm"], int(size["arms"])
    ring, width = size["ring_mm"] / 2, size["arm_mm"] / 2
    body = tube(ring, bore, 0, t)
    angles = np.linspace(-np.pi / 2, np.pi / 2, 9)
    crown = np.stack([outer - width + width * np.cos(angles), width * np.sin(angles)], axis=1)
    foot = np.sqrt(ring**2 - width**2) - 0.5
    arm = sh.plate(np.concatenate([[[foot, -width]], crown, [[foot, width]]]), 0, t)
    for number in range(arms):
        body = body + arm.turned("z", 360 * number / arms)
    return body.solid(merge=False)


def oldham_hub(size: dict[str, float]) -> s.Solid:
    """A bored hub with the tongue of an Oldham coupling across its upper face."""
    outer, bore, top = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"]
    reach, width = top - size["tongue_mm"], size["width_mm"] / 2
    tongue = sh.block(bore, np.sqrt(outer**2 - width**2), -width, width, reach - 0.5, top)
    screw = s.drill(size["screw_mm"] / 2, (0, 0, 0.45 * reach), "x", outer + 1)
    return (tube(outer, bore, 0, reach) + tongue + tongue.mirrored("x")).drilled(screw).solid()


def oldham_disc(size: dict[str, float]) -> s.Solid:
    """The sliding disc of an Oldham coupling: a groove across each face, at right angles, and a bore."""
    r, t, width, deep = size["D_mm"] / 2, size["t_mm"], size["width_mm"] / 2, size["groove_mm"]
    lower = sh.cylinder(r, 0, deep) - sh.block(-r - 1, r + 1, -width, width, -1, deep + 1)
    middle = sh.cylinder(r, deep, t - deep)
    upper = sh.cylinder(r, t - deep, t) - sh.block(-width, width, -r - 1, r + 1, t - deep - 1, t + 1)
    disc = lower + middle + upper
    bore = sh.tool(s.extrude(s.circle(size["d_mm"] / 2), -1, t + 1))
    return disc.drilled(bore).solid()


def flange_coupling(size: dict[str, float]) -> s.Solid:
    """Half of a flange coupling: bored hub, bolted flange below with its centring spigot."""
    outer, bore, hub, top = size["D_mm"] / 2, size["d_mm"] / 2, size["hub_mm"] / 2, size["L_mm"]
    t, spigot = size["t_mm"], 0.7 * size["hub_mm"] / 2
    profile = [(bore, -2), (max(spigot, bore + 3), -2), (max(spigot, bore + 3), 0), (outer, 0), (outer, t)]
    body = sh.turned([*profile, (hub, t), (hub, top), (bore, top)])
    holes = bolt_circle((outer + hub) / 2, size["hole_mm"] / 2, int(size["holes"]), -1, t + 0.5)
    return body.drilled(*holes).solid()


def bellows_coupling(size: dict[str, float]) -> s.Solid:
    """Two bored hubs with a corrugated tube between them; its inside is solid down to the bore."""
    outer, bore, top, hub = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"], size["hub_mm"]
    folds, valley = int(size["folds"]), outer - size["depth_mm"]
    pitch = (top - 2 * hub) / folds
    bellows = [(valley, hub)]
    for number in range(folds):
        z = hub + number * pitch
        bellows += [(valley, z + 0.25 * pitch), (outer, z + 0.4 * pitch), (outer, z + 0.6 * pitch)]
        bellows += [(valley, z + 0.75 * pitch)]
    profile = [(bore, 0), (outer, 0), (outer, hub), *bellows, (valley, top - hub), (outer, top - hub)]
    body = sh.turned([*profile, (outer, top), (bore, top)])
    r = size["screw_mm"] / 2
    return body.drilled(*(s.drill(r, (0, 0, z), "x", outer + 1) for z in (hub / 2, top - hub / 2))).solid()


def beam_coupling(size: dict[str, float]) -> s.Solid:
    """A sleeve made flexible by narrow cuts, each through all but a bridge, alternating by a quarter turn."""
    outer, bore, top, cuts = size["D_mm"] / 2, size["d_mm"] / 2, size["L_mm"], int(size["cuts"])
    body = tube(outer, bore, 0, top)
    middle = np.linspace(0.32, 0.68, cuts) * top
    for number, z in enumerate(middle):
        cut = sh.block(-0.55 * bore, outer + 1, -outer - 1, outer + 1, z - 0.5, z + 0.5)
        body = body.drilled(cut.turned("z", 90 * number))
    heights = np.array([0.13, 0.87]) * top
    slots = [
        sh.block(0, outer + 1, -SLOT / 4, SLOT / 4, z0, z1)
        for z0, z1 in ((-1, 0.26 * top), (0.74 * top, top + 1))
    ]
    return body.drilled(*slots, *_clamp_screws(outer, bore, size["screw_mm"], heights)).solid()


def clamp_collar(size: dict[str, float]) -> s.Solid:
    """A ring slotted at one side, with its clamp screw across the slot."""
    outer, bore, width = size["D_mm"] / 2, size["d_mm"] / 2, size["b_mm"]
    slot = sh.block(0, outer + 1, -SLOT / 2, SLOT / 2, -1, width + 1)
    screw = _clamp_screws(outer, bore, size["screw_mm"], np.array([width / 2]))
    return tube(outer, bore, 0, width).drilled(slot, *screw).solid()


def two_piece_collar(size: dict[str, float]) -> s.Solid:
    """A ring in two halves, held together by the screws across the gaps."""
    outer, bore, width, screw = size["D_mm"] / 2, size["d_mm"] / 2, size["b_mm"], size["screw_mm"]
    gap = sh.block(-outer - 1, outer + 1, -SLOT / 2, SLOT / 2, -1, width + 1)
    holes = _clamp_screws(outer, bore, screw, np.array([width / 2]))
    holes += [hole.rotate((0.0, 0.0, 180.0)) for hole in holes]
    body = tube(outer, bore, 0, width).drilled(gap, *holes)
    # The bolts fill their holes to the bottom: a void inside would be a separate body.
    x = (outer + bore) / 2
    reach = np.sqrt(outer**2 - x**2) + 1
    bolt = sh.tool(s.drill(screw / 2 + 0.1, (x, -0.5 * reach, width / 2), "y", 1.25 * reach))
    body = body + bolt + bolt.turned("z", 180)
    return body.solid()


def boss_collar(size: dict[str, float]) -> s.Solid:
    """A ring with a boss for a long set screw at +x."""
    outer, bore, width = size["D_mm"] / 2, size["d_mm"] / 2, size["b_mm"]
    boss, reach = size["boss_mm"] / 2, outer + size["reach_mm"]
    stud = sh.cylinder(boss, outer - 0.6 * (outer - bore), reach).turned("y", 90).moved(z=width / 2)
    screw = s.drill(size["screw_mm"] / 2, (0, 0, width / 2), "x", reach + 1)
    return (tube(outer, bore, 0, width) + stud).drilled(screw).solid()


def hub_collar(size: dict[str, float]) -> s.Solid:
    """A mounting hub: a round flange with screw holes on a sleeve with a set screw and a groove."""
    outer, bore, flange = size["D_mm"] / 2, size["d_mm"] / 2, size["flange_mm"] / 2
    t, top = size["t_mm"], size["L_mm"]
    body = sh.turned([(bore, 0), (flange, 0), (flange, t), (outer, t), (outer, top), (bore, top)])
    holes = bolt_circle((outer + flange) / 2, size["hole_mm"] / 2, int(size["holes"]), -1, t + 0.5)
    screw = s.drill(size["screw_mm"] / 2, (0, 0, (t + top) / 2), "x", outer + 1)
    ring = groove(outer, outer - 0.5, top - 3, top - 2)
    return body.drilled(*holes, screw, ring).solid()
