"""Gears with involute teeth: spur gears, lightened ones, pinion shafts, helical gears."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from manifold3d import CrossSection, FillRule

from mskgrasp.parts.recipes.families.listing import CAST_IRON, one, one_per_row
from mskgrasp.parts.recipes.recipe import STEEL, Recipe, table_row
from mskgrasp.parts.solids import shape as sh
from mskgrasp.parts.solids import solid as s

PRESSURE_ANGLE = np.radians(20)  # ISO 53
ADDENDUM, DEDENDUM, FILLET = 1.0, 1.25, 0.38  # in modules, ISO 53 profile A

SOURCE = "ISO 54, ISO 53 profile A"

MOST_TWIST = np.radians(24)
"""Greatest twist of one hull of a helical tooth, radians; the hull then stays within 0.7 mm of it."""


def recipes() -> Iterator[Recipe]:
    """The built-in gears; teeth, face width, bore and hub are our choice within usual catalogue ranges."""
    for module, teeth, face, bore, hub, hub_length in ((2, 18, 20, 12, 0, 0), (3, 17, 15, 15, 36, 13)):
        sizes = {
            "teeth": float(teeth),
            "face_mm": float(face),
            "bore_mm": float(bore),
            "hub_mm": float(hub),
            "hub_length_mm": float(hub_length),
        }
        size = table_row("iso54_spur_gear.csv", m_mm=module) | sizes
        yield one(size, "spur_gear_m{m}_z{teeth}", spur_gear, source=SOURCE)
    for file_name, name, make, density in (
        ("spur_gear.csv", "spur_gear_m{m}_z{teeth}x{face}", spur_gear, STEEL),
        ("webbed_gear.csv", "webbed_gear_m{m}_z{teeth}x{face}", webbed_gear, CAST_IRON),
        ("spoked_gear.csv", "spoked_gear_m{m}_z{teeth}x{face}", spoked_gear, CAST_IRON),
        ("pinion_shaft.csv", "pinion_shaft_m{m}_z{teeth}x{l}", pinion_shaft, STEEL),
        ("helical_gear.csv", "helical_gear_m{m}_z{teeth}x{face}", helical_gear, STEEL),
    ):
        yield from one_per_row(file_name, name, make, source=SOURCE, density=density)


def spur_gear(size: dict[str, float]) -> s.Solid:
    """Teeth between z = 0 and the face width, the hub (if any) above."""
    module, teeth, face, bore = size["m_mm"], int(size["teeth"]), size["face_mm"], size["bore_mm"] / 2
    hub, hub_top = size["hub_mm"] / 2, size["face_mm"] + size["hub_length_mm"]
    root = module * teeth / 2 - DEDENDUM * module
    body = s.extrude(_gear_outline(module, teeth), 0, face)
    hulls = s.ring(root, bore, 0, face)
    for number in range(teeth):
        tooth = _turned(_tooth(module, teeth, samples=7), 2 * np.pi * number / teeth)
        hulls.append(s.prism(tooth, 0, face))
    if hub > 0:
        body = body + s.extrude(s.circle(hub), face / 2, hub_top)
        hulls += s.ring(hub, bore, face, hub_top)
    return s.solid(body - s.extrude(s.circle(bore), -1, hub_top + 1), hulls)


def toothing(module: float, teeth: int, face: float, core: sh.Shape, helix: float = 0.0) -> sh.Shape:
    """Teeth between z = 0 and the face width around a core that reaches a little above the root circle.

    Args:
        module: Normal module.
        teeth: Their number.
        face: Face width.
        core: Body that fills the gear up to its root circle.
        helix: Helix angle in radians, positive for a right-hand gear.
    """
    transverse = module / np.cos(helix)
    twist = face * np.tan(helix) / (transverse * teeth / 2)
    steps = max(1, int(np.ceil(abs(twist) / MOST_TWIST)))
    outline = _gear_outline(transverse, teeth, module)
    # A thin rim carries the teeth; the core fills it in any shape.
    rim = s.circle(transverse * teeth / 2 - DEDENDUM * module - 0.4 * module)
    section = CrossSection([outline, rim], FillRule.EvenOdd)
    body = section.extrude(face, 4 * steps if twist else 0, float(np.degrees(twist)))
    levels = np.linspace(0, 1, steps + 1)
    hulls = []
    for number in range(teeth):
        tooth = _tooth(transverse, teeth, samples=7, module=module)
        slices = [
            np.column_stack(
                [_turned(tooth, 2 * np.pi * number / teeth + twist * t), np.full(len(tooth), face * t)]
            )
            for t in levels
        ]
        hulls += [np.concatenate(pair) for pair in zip(slices[:-1], slices[1:], strict=True)]
    return core + sh.tool(body, hulls)


def webbed_gear(size: dict[str, float]) -> s.Solid:
    """A gear with a thin web between its rim and its hub."""
    web, rim = size["web_mm"] / 2, root_radius(size) - size["rim_mm"]
    z0, z1 = size["face_mm"] / 2 - web, size["face_mm"] / 2 + web
    disc = s.around_hole(s.polygon(rim + 0.5, 12), s.polygon(size["hub_mm"] / 2, 6), z0, z1)
    body = s.extrude(s.circle(rim + 0.5), z0, z1) - s.extrude(s.circle(size["bore_mm"] / 2), z0 - 1, z1 + 1)
    return (rim_and_hub(size, rim) + sh.tool(body, disc)).solid(merge=False)


def spoked_gear(size: dict[str, float]) -> s.Solid:
    """A gear with straight spokes between its rim and its hub."""
    rim, hub, width = root_radius(size) - size["rim_mm"], size["hub_mm"] / 2, size["spoke_mm"] / 2
    z0, z1 = size["face_mm"] / 2 - size["web_mm"] / 2, size["face_mm"] / 2 + size["web_mm"] / 2
    gear = rim_and_hub(size, rim)
    # The spokes end inside hub and rim, whose facets they must not pierce.
    spoke = sh.block(np.sqrt(hub**2 - width**2) - 1, rim + 0.3 * size["rim_mm"], -width, width, z0, z1)
    for number in range(int(size["spokes"])):
        gear = gear + spoke.turned("z", 360 * number / size["spokes"])
    return gear.solid(merge=False)


def rim_and_hub(size: dict[str, float], rim: float) -> sh.Shape:
    """The toothed rim of inner radius ``rim`` and the bored hub in its middle, not joined."""
    face, root, hub, bore = size["face_mm"], root_radius(size), size["hub_mm"] / 2, size["bore_mm"] / 2
    low, high = (face - size["hub_length_mm"]) / 2, (face + size["hub_length_mm"]) / 2
    # Ten wedges represent the rim; its inner side is in the web's recess, which fingers do not reach.
    wedges = s.around_hole(s.round_outline(root, 10), s.balanced_polygon(rim, 10), 0, face)
    ring = sh.tool(s.extrude(s.circle(root), 0, face, [s.circle(rim)]), wedges)
    tube = sh.tool(s.extrude(s.circle(hub), low, high, [s.circle(bore)]), s.ring(hub, bore, low, high))
    return toothing(size["m_mm"], int(size["teeth"]), face, ring + tube)


def pinion_shaft(size: dict[str, float]) -> s.Solid:
    """A pinion cut into its shaft: a journal below, the teeth, a journal and a shaft end above."""
    face, low, high = size["face_mm"], size["below_mm"], size["l_mm"] - size["below_mm"] - size["face_mm"]
    root, journal, end = root_radius(size), size["journal_mm"] / 2, size["end_mm"] / 2
    seat = high - size["end_length_mm"]
    core = sh.turned(
        [(0, -low), (journal - 1, -low), (journal, 1 - low), (journal, 0), (root, 0), (root, face)]
        + [(journal, face), (journal, face + seat), (end, face + seat), (end, face + high - 1)]
        + [(end - 1, face + high), (0, face + high)]
    )
    gear = toothing(size["m_mm"], int(size["teeth"]), face, core, np.radians(size["helix_deg"]))
    return gear.solid(merge=False)


def helical_gear(size: dict[str, float]) -> s.Solid:
    """Helical teeth, a bore, and a hub above if there is one."""
    face, helix, bore = size["face_mm"], np.radians(size["helix_deg"]), size["bore_mm"] / 2
    hub, top, root = size["hub_mm"] / 2, face + size["hub_length_mm"], root_radius(size)
    profile = [(bore, 0), (root, 0), (root, face)] + [(hub, face), (hub, top)] * int(hub > 0) + [(bore, top)]
    return toothing(size["m_mm"], int(size["teeth"]), face, sh.turned(profile), helix).solid(merge=False)


def root_radius(size: dict[str, float]) -> float:
    """Radius of the root circle."""
    helix = np.radians(size.get("helix_deg", 0.0))
    return float(size["m_mm"] * (size["teeth"] / np.cos(helix) / 2 - DEDENDUM))


def _gear_outline(transverse: float, teeth: int, module: float = 0.0) -> np.ndarray:
    module = module or transverse
    root = transverse * teeth / 2 - DEDENDUM * module
    shapes = [shapely.Polygon(s.circle(root))]
    tooth = _tooth(transverse, teeth, samples=12, module=module)
    shapes += [shapely.Polygon(_turned(tooth, 2 * np.pi * n / teeth)) for n in range(teeth)]
    fillet = FILLET * module
    # Growing and shrinking rounds exactly the corners between tooth and root.
    rounded = shapely.unary_union(shapes).buffer(fillet, quad_segs=6).buffer(-fillet, quad_segs=6)
    return np.asarray(shapely.get_coordinates(shapely.Polygon(rounded.exterior).simplify(0.005)))[:-1]


def _tooth(transverse: float, teeth: int, samples: int, module: float = 0.0) -> np.ndarray:
    """Outline (2 samples + 2, 2) of the tooth that points along +x; radial below the base circle."""
    module = module or transverse
    pressure_angle = np.arctan(np.tan(PRESSURE_ANGLE) * transverse / module)
    pitch = transverse * teeth / 2
    base, root, tip = pitch * np.cos(pressure_angle), pitch - DEDENDUM * module, pitch + ADDENDUM * module
    radius = np.linspace(max(base, root), tip, samples)
    half_angle = np.pi / (2 * teeth) + _involute(pressure_angle) - _involute(np.arccos(base / radius))
    # The foot reaches into the gear's body, so that no slit stays between tooth and body.
    radius = np.concatenate([[root - 0.15 * module], radius])
    half_angle = np.concatenate([half_angle[:1], half_angle])
    lower = np.stack([radius * np.cos(half_angle), -radius * np.sin(half_angle)], axis=1)
    return np.concatenate([lower, lower[::-1] * [1, -1]])


def _involute(angle: np.ndarray | float) -> np.ndarray:
    return np.tan(angle) - angle


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])
