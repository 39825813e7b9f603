"""Rings that sit on shafts: ball bearings, bushings and shaft collars."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mskgrasp.parts import solid as s
from mskgrasp.parts.families.recipe import BRONZE, STEEL, Recipe, table_row

BEARING = 5300.0
"""kg/m^3 of the solid ring: with it a 6204 weighs its catalogue mass of 0.106 kg; raceways are hollow."""


def recipes() -> Iterator[Recipe]:
    """The built-in rings."""
    for code in (6202, 6205):
        row = table_row("iso15_bearing.csv", code=code)
        del row["code"]
        yield _recipe(f"bearing_{code}", "bearing", "ISO 15", BEARING, row, bearing)
    row = table_row("iso4379_bushing.csv", d1_mm=20)
    yield _recipe("bushing_20x26x30", "bushing", "ISO 4379", BRONZE, row, bushing)
    row = table_row("din705_shaft_collar.csv", d1_mm=25)
    yield _recipe("shaft_collar_25", "shaft_collar", "DIN 705", STEEL, row, shaft_collar)


def _recipe(
    name: str, family: str, source: str, density: float, dimensions: dict[str, float], make: s.Maker
) -> Recipe:
    return Recipe(name=name, family=family, source=source, density=density, dimensions=dimensions, make=make)


def bearing(size: dict[str, float]) -> s.Solid:
    """A ring with rounded edges and the shields set 0.4 mm deep; its hulls have sharp edges and no recess."""
    inner, outer, width, r = size["d_mm"] / 2, size["D_mm"] / 2, size["B_mm"], size["r_mm"]
    wall, deep = outer - inner, 0.4
    profile = [
        *_rounded(inner, 0, r, 1, 1),
        (inner + 0.25 * wall, 0),
        (inner + 0.25 * wall, deep),
        (outer - 0.25 * wall, deep),
        (outer - 0.25 * wall, 0),
        *_rounded(outer, 0, r, -1, 1)[::-1],
        *_rounded(outer, width, r, -1, -1),
        (outer - 0.25 * wall, width),
        (outer - 0.25 * wall, width - deep),
        (inner + 0.25 * wall, width - deep),
        (inner + 0.25 * wall, width),
        *_rounded(inner, width, r, 1, -1)[::-1],
    ]
    return s.solid(s.lathe(profile), s.ring(outer, inner, 0, width))


def _rounded(radius: float, z: float, r: float, inward: int, up: int) -> list[tuple[float, float]]:
    """A rounded corner, from the cylinder (``radius``) to the face (``z``)."""
    angles = np.linspace(0, np.pi / 2, 5)
    return [(radius + inward * r * (1 - np.cos(angle)), z + up * r * (1 - np.sin(angle))) for angle in angles]


def bushing(size: dict[str, float]) -> s.Solid:
    """A plain tube."""
    outer, bore, length = size["d2_mm"] / 2, size["d1_mm"] / 2, size["b1_mm"]
    return s.solid(s.extrude(s.circle(outer), 0, length, [s.circle(bore)]), s.ring(outer, bore, 0, length))


def shaft_collar(size: dict[str, float]) -> s.Solid:
    """A plain ring."""
    outer, bore, width = size["d2_mm"] / 2, size["d1_mm"] / 2, size["b_mm"]
    return s.solid(s.extrude(s.circle(outer), 0, width, [s.circle(bore)]), s.ring(outer, bore, 0, width))
