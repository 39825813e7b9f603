"""Spur gears with involute teeth."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from mskgrasp.parts import solid as s
from mskgrasp.parts.families.recipe import STEEL, Recipe, table_row

PRESSURE_ANGLE = np.radians(20)  # ISO 53
ADDENDUM, DEDENDUM, FILLET = 1.0, 1.25, 0.38  # in modules, ISO 53 profile A


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
        yield Recipe(
            name=f"spur_gear_m{module}_z{teeth}",
            family="spur_gear",
            source="ISO 54, ISO 53 profile A",
            density=STEEL,
            dimensions=table_row("iso54_spur_gear.csv", m_mm=module) | sizes,
            make=spur_gear,
        )


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


def _gear_outline(module: float, teeth: int) -> np.ndarray:
    root = module * teeth / 2 - DEDENDUM * module
    shapes = [shapely.Polygon(s.circle(root))]
    tooth = _tooth(module, teeth, samples=12)
    shapes += [shapely.Polygon(_turned(tooth, 2 * np.pi * n / teeth)) for n in range(teeth)]
    fillet = FILLET * module
    # Growing and shrinking rounds exactly the corners between tooth and root.
    rounded = shapely.unary_union(shapes).buffer(fillet, quad_segs=6).buffer(-fillet, quad_segs=6)
    return np.asarray(shapely.get_coordinates(shapely.Polygon(rounded.exterior).simplify(0.005)))[:-1]


def _tooth(module: float, teeth: int, samples: int) -> np.ndarray:
    """Outline (2 samples + 2, 2) of the tooth that points along +x; radial below the base circle."""
    pitch = module * teeth / 2
    base, root, tip = pitch * np.cos(PRESSURE_ANGLE), pitch - DEDENDUM * module, pitch + ADDENDUM * module
    radius = np.linspace(max(base, root), tip, samples)
    half_angle = np.pi / (2 * teeth) + _involute(PRESSURE_ANGLE) - _involute(np.arccos(base / radius))
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
