"""Racks, bevel gears and worms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold, OpType

from mskgrasp.parts.recipes.families.gears import ADDENDUM, DEDENDUM, PRESSURE_ANGLE
from mskgrasp.parts.recipes.families.listing import one_per_row
from mskgrasp.parts.recipes.recipe import BRONZE, STEEL, Recipe
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

TOOTH = "ISO 54, ISO 53 profile A; own body"


def recipes() -> Iterator[Recipe]:
    """The built-in racks, bevel gears and worms."""
    for file_name, name, make, density in (
        ("rack.csv", "rack_m{m}x{teeth}x{h}", rack, STEEL),
        ("round_rack.csv", "round_rack_m{m}x{teeth}x{l}", round_rack, STEEL),
        ("bevel_gear.csv", "bevel_gear_m{m}_z{teeth}x{mate}", bevel_gear, STEEL),
        ("worm.csv", "worm_m{m}x{l}", worm, BRONZE),
    ):
        yield from one_per_row(file_name, name, make, density=density, source=TOOTH)


def rack(size: dict[str, float]) -> s.Solid:
    """A bar along x with teeth on top and counterbored screw holes across, which hulls fill."""
    module, teeth, width, pitch_line = size["m_mm"], int(size["teeth"]), size["b_mm"] / 2, size["h_mm"]
    pitch, length = np.pi * module, np.pi * module * teeth
    root, tip = pitch_line - DEDENDUM * module, pitch_line + ADDENDUM * module
    body = sh.block(0, length, -width, width, 0, root)
    for number in range(teeth):
        body = body + _rack_tooth(module, (number + 0.5) * pitch, -width, width, root, tip)
    holes, r = int(size["holes"]), size["hole_mm"] / 2
    for x in (np.arange(holes) + 0.5) * length / max(holes, 1):
        z = 0.45 * root
        body = body.drilled(s.drill(r, (x, -width - 1, z), "y", 2 * width + 2))
    return body.solid(merge=False)


def _rack_tooth(module: float, x: float, y0: float, y1: float, root: float, tip: float) -> sh.Shape:
    slope = np.tan(PRESSURE_ANGLE)
    foot, top = (
        np.pi * module / 4 + DEDENDUM * module * slope,
        np.pi * module / 4 - ADDENDUM * module * slope,
    )
    corners = np.array([[x - foot, root - 0.2], [x + foot, root - 0.2], [x + foot, root], [x + top, tip]])
    corners = np.concatenate([corners, [[x - top, tip], [x - foot, root]]])
    # Extruded along z, then turned so that the outline's second axis is z.
    return sh.plate(corners, -y1, -y0).turned("x", 90)


def round_rack(size: dict[str, float]) -> s.Solid:
    """A round bar along z with teeth milled into its +x side, chamfered ends."""
    module, teeth, r, total = size["m_mm"], int(size["teeth"]), size["d_mm"] / 2, size["l_mm"]
    pitch = np.pi * module
    start, length = (total - teeth * pitch) / 2, teeth * pitch
    tip = 0.8 * r
    root = tip - (ADDENDUM + DEDENDUM) * module
    ends = sh.turned([(0, 0), (r - 1, 0), (r, 1), (r, start), (0, start)])
    bar = sh.cylinder(r, start, start + length) - sh.block(
        root, r + 1, -r - 1, r + 1, start - 1, start + length + 1
    )
    body = ends + bar + ends.mirrored("z").moved(z=total)
    round_bar = sh.cylinder(r, 0, total).body
    for number in range(teeth):
        half = np.sqrt(r**2 - tip**2) + 0.7 * module * np.tan(PRESSURE_ANGLE)
        tooth = _rack_tooth(module, start + (number + 0.5) * pitch, -r, r, root, tip).turned("y", -90)
        tooth = tooth.mirrored("x") if tooth.hulls[0][:, 0].max() < 0 else tooth
        # The bar's curvature narrows a tooth towards its tip: exactly in the body, by a mean in the hull.
        hull = tooth.hulls[0].copy()
        hull[:, 1] = np.sign(hull[:, 1]) * np.sqrt(np.maximum(r**2 - hull[:, 0] ** 2, half**2 / 4))
        body = body + sh.tool(tooth.body ^ round_bar, [hull])
    return body.solid(merge=False)


def bevel_gear(size: dict[str, float]) -> s.Solid:
    """A straight bevel gear, its large end and its hub below; all lines of a tooth run to the apex."""
    module, teeth, bore = size["m_mm"], int(size["teeth"]), size["bore_mm"] / 2
    cone = np.arctan(teeth / size["mate"])
    pitch = module * teeth / 2
    distance = pitch / np.sin(cone)
    apex = distance * np.cos(cone)
    shrink = 1 - size["face_mm"] / distance

    def place(height: float, share: float) -> tuple[float, float]:
        """Radius and z of a point ``height`` over the pitch cone, on the back cone or nearer the apex."""
        r, z = pitch + height * np.cos(cone), height * np.sin(cone)
        return float(share * r), float(apex + share * (z - apex))

    foot = -DEDENDUM * module
    back, front = place(foot, 1.0), place(foot, shrink)
    hub, low = size["hub_mm"] / 2, back[1] - size["hub_length_mm"]
    core = sh.turned([(bore, low), (hub, low), (hub, back[1]), back, front, (bore, front[1])])
    heights = np.linspace(foot, ADDENDUM * module, 7)
    virtual = pitch / np.cos(cone)  # Tredgold: the tooth is that of a spur gear on the developed back cone
    base = virtual * np.cos(PRESSURE_ANGLE)
    pressure = np.arccos(base / np.maximum(virtual + heights, base))
    half = np.pi * module / 4 / virtual + _involute(PRESSURE_ANGLE) - _involute(pressure)
    points = []
    for height, angle in zip([foot - 0.15 * module, *heights], [half[0], *half], strict=True):
        for share in (1.0, shrink):
            r, z = place(height, share)
            turn = angle * (virtual + height) / (pitch + height * np.cos(cone))
            points += [[r * np.cos(turn), r * np.sin(turn), z], [r * np.cos(turn), -r * np.sin(turn), z]]
    tooth = sh.convex(np.array(points))
    for number in range(teeth):
        core = core + tooth.turned("z", 360 * number / teeth)
    return core.solid(merge=False)


def _involute(angle: np.ndarray | float) -> np.ndarray:
    return np.tan(angle) - angle


def worm(size: dict[str, float]) -> s.Solid:
    """A single-start worm with a journal at each end; its thread is a row of short hulls."""
    module, total, journal = size["m_mm"], size["l_mm"], size["journal_mm"] / 2
    pitch, length, ends = np.pi * module, size["thread_mm"], (total - size["thread_mm"]) / 2
    reference = size["d_mm"] / 2
    root, tip = reference - 1.2 * module, reference + module
    core = sh.turned(
        [(0, -ends), (journal, -ends), (journal, 0), (root, 0), (root, length), (journal, length)]
        + [(journal, length + ends), (0, length + ends)]
    )
    slope = np.tan(PRESSURE_ANGLE)
    foot, top = np.pi * module / 4 + 1.2 * module * slope, np.pi * module / 4 - module * slope
    turns = (length - 2 * foot) / pitch

    def thread(step: float, swell: float, overlap: float) -> list[np.ndarray]:
        angles = np.linspace(0, 2 * np.pi * turns, round(2 * np.pi * turns / step) + 1)
        # Pieces that only touch would leave slits between their twisted faces.
        ends = zip(angles[:-1] - overlap, angles[1:] + overlap, strict=True)
        return [np.concatenate([section(angle, swell) for angle in pair]) for pair in ends]

    def section(angle: float, swell: float) -> np.ndarray:
        z = foot + pitch * angle / (2 * np.pi)
        rz = [(root - 0.6, -foot), (root, -foot), (tip * swell, -top), (tip * swell, top), (root, foot)]
        return np.array(
            [[r * np.cos(angle), r * np.sin(angle), z + dz] for r, dz in [*rz, (root - 0.6, foot)]]
        )

    fine = [Manifold.hull_points(points) for points in thread(np.radians(6), 1.0, np.radians(0.5))]
    coarse = np.radians(size["step_deg"])
    hulls = thread(coarse, 2 / (1 + np.cos(coarse / 2)), 0.0)
    return (core + sh.tool(Manifold.batch_boolean(fine, OpType.Add), hulls)).solid(merge=False)
