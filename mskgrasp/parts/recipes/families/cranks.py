"""Eccentrics, cams and cranks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.families.rings import tube
from mskgrasp.parts.recipes.families.shafts import seats
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s


def recipes() -> Iterator[Recipe]:
    """The built-in eccentrics, cams and cranks; no standard fixes any."""
    for file_name, name, make in (
        ("eccentric_shaft.csv", "eccentric_shaft_{d2}x{e}x{l2}", eccentric_shaft),
        ("cam_shaft.csv", "cam_shaft_{d}x{cams}x{l}", cam_shaft),
        ("crank_shaft.csv", "crank_shaft_{throw}x{l}", crank_shaft),
        ("crank_arm.csv", "crank_arm_{apart}x{pin}", crank_arm),
        ("disc_cam.csv", "disc_cam_{base}x{lift}x{L}", disc_cam),
        ("eccentric_bushing.csv", "eccentric_bushing_{D}x{d}x{L}", eccentric_bushing),
    ):
        yield from one_per_row(file_name, name, make)


def eccentric_shaft(size: dict[str, float]) -> s.Solid:
    """A shaft with an eccentric middle seat."""
    l1, l2 = size["l1_mm"], size["l2_mm"]
    lower = seats({"d1_mm": size["d1_mm"], "l1_mm": l1 + 1})
    upper = seats({"d1_mm": size["d3_mm"], "l1_mm": size["l3_mm"] + 1}).moved(z=l1 + l2 - 1)
    middle = sh.cylinder(size["d2_mm"] / 2, l1, l1 + l2).moved(x=size["e_mm"])
    return (lower + middle + upper).solid()


def cam_outline(base: float, nose: float, lift: float, segments: int) -> np.ndarray:
    """Base circle about the origin and nose circle, joined by tangents; the tip is ``lift`` further out."""
    circles = [s.polygon(base, segments), s.polygon(nose, segments) + [base + lift - nose, 0.0]]
    hull = shapely.MultiPoint(np.concatenate(circles)).convex_hull
    return np.asarray(shapely.get_coordinates(hull))[:-1]


def _cam(base: float, nose: float, lift: float, z0: float, z1: float) -> sh.Shape:
    fine, coarse = (cam_outline(base, nose, lift, segments) for segments in (128, 20))
    # One hull for the base circle, one for its front half with the nose.
    front = np.concatenate([coarse[coarse[:, 0] > 0.1], [[0.0, -base], [0.0, base]]])
    hulls = [s.prism(s.balanced_polygon(base, 16), z0, z1), s.prism(front, z0, z1)]
    return sh.tool(s.extrude(fine, z0, z1), hulls)


def cam_shaft(size: dict[str, float]) -> s.Solid:
    """A shaft with cams turned evenly against each other."""
    cams, width, total = int(size["cams"]), size["width_mm"], size["l_mm"]
    body = seats({"d1_mm": size["d_mm"], "l1_mm": total})
    for number in range(cams):
        middle = total * (number + 1) / (cams + 1)
        cam = _cam(
            size["base_mm"] / 2, size["nose_mm"], size["lift_mm"], middle - width / 2, middle + width / 2
        )
        body = body + cam.turned("z", 360 * number / cams)
    return body.solid(merge=False)


def crank_shaft(size: dict[str, float]) -> s.Solid:
    """Two journals, two webs, one crank pin."""
    journal, pin, throw = size["journal_mm"] / 2, size["pin_mm"] / 2, size["throw_mm"]
    web, gap, total = size["web_mm"], size["gap_mm"], size["l_mm"]
    end = (total - gap - 2 * web) / 2
    lower = seats({"d1_mm": 2 * journal, "l1_mm": end + 1})
    shape = cam_outline(1.3 * journal, 1.3 * pin, throw + 1.3 * pin - 1.3 * journal, 20)
    cheek = sh.plate(shape, end, end + web)
    half = lower + cheek
    middle = sh.cylinder(pin, end + web - 1, end + web + gap + 1).moved(x=throw)
    return (half + middle + half.mirrored("z").moved(z=total)).solid()


def crank_arm(size: dict[str, float]) -> s.Solid:
    """An arm with a bored boss at one end and a pin at the other."""
    boss, bore, top = size["boss_mm"] / 2, size["bore_mm"] / 2, size["height_mm"]
    pin, apart, t = size["pin_mm"] / 2, size["apart_mm"], size["t_mm"]
    small = 1.5 * pin
    outline = cam_outline(0.85 * boss, small, apart + small - 0.85 * boss, 24)
    arm = sh.plate(outline, 0, t, [(0, 0, bore)])
    stud = sh.cylinder(pin, t - 1, size["pin_length_mm"] + t).moved(x=apart)
    return (arm + tube(boss, bore, 0, top) + stud).solid()


def disc_cam(size: dict[str, float]) -> s.Solid:
    """A plate cam on a bored hub with a set screw."""
    base, lift, bore, t = size["base_mm"] / 2, size["lift_mm"], size["bore_mm"] / 2, size["t_mm"]
    fine, coarse = (cam_outline(base, size["nose_mm"], lift, segments) for segments in (128, 24))
    hulls = s.around_hole(coarse, s.bore_polygon(bore), 0, t)
    plate = sh.tool(s.extrude(fine, 0, t, [s.circle(bore)]), hulls)
    hub, top = size["hub_mm"] / 2, size["L_mm"]
    screw = s.drill(size["screw_mm"] / 2, (0, 0, (t + top) / 2), "x", hub + 1)
    return (plate + tube(hub, bore, t - 0.5, top)).drilled(screw).solid()


def eccentric_bushing(size: dict[str, float]) -> s.Solid:
    """A tube with an eccentric bore and a round flange."""
    r, bore, e, top = size["D_mm"] / 2, size["d_mm"] / 2, size["e_mm"], size["L_mm"]
    flange, t = size["flange_mm"] / 2, size["t_mm"]
    hole = s.bore_polygon(bore, centre=(e, 0))
    pieces = []
    for radius, z0, z1 in ((flange, 0, t), (r, t, top)):
        body = s.extrude(s.circle(radius), z0, z1, [s.circle(bore, (e, 0))])
        pieces.append(sh.tool(body, s.around_hole(s.round_outline(radius, len(hole)), hole, z0, z1)))
    return (pieces[0] + pieces[1]).solid()
