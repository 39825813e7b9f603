"""Pipes, rails, rings and machine parts from bd_warehouse."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mskgrasp.parts.recipes.cad.brep import Row, lengths, mesh_of, needs_cad, table
from mskgrasp.parts.recipes.cad.hulls import extruded_hulls, turned_hulls
from mskgrasp.parts.recipes.recipe import ALUMINIUM, STEEL, Recipe
from mskgrasp.parts.solids import solid as s

RUBBER = 1250.0
POLYAMIDE = 1140.0

FAMILIES = {
    "chamfered_washer": ("ISO 7090", STEEL),
    "gantry_part": ("OpenBuilds", ALUMINIUM),
    "o_ring": ("ISO 3601", RUBBER),
    "pipe": ("ASME B36.10", STEEL),
    "slot_rail": ("OpenBuilds", ALUMINIUM),
}
"""The standard and the density in kg/m^3 of each family."""


def recipes() -> Iterator[Recipe]:
    """One part for each row of the table."""
    for row in table("stock.csv"):
        standard, density = FAMILIES[row["family"]]
        if row["class"] == "XtremeSolidVWheel":
            density = POLYAMIDE
        yield Recipe(
            name=row["name"],
            family=row["family"],
            source=f"{standard} {row['a']}".strip() + ", bd_warehouse 0.4.0",
            density=density,
            dimensions=lengths({key: text for key, text in row.items() if text}),
            make=_maker(row),
        )


def _maker(row: Row) -> Callable[[dict[str, float]], s.Solid]:
    @needs_cad
    def make(size: dict[str, float]) -> s.Solid:
        mesh = mesh_of(_drawn(row, size))
        match row["class"]:
            case "Pipe" | "ChamferedWasher" | "AluminumSpacer":
                hulls = turned_hulls(mesh)
            case "VSlotLinearRail":
                hulls = extruded_hulls(mesh, filled_mm=0.5, detail_mm=0.4, slack=0.03)
            case "ORing":
                hulls = _torus_pieces(mesh.extents)
            case _:
                hulls = []
        return s.Solid(mesh=mesh, hulls=tuple(hulls))

    return make


def _drawn(row: Row, size: dict[str, float]) -> Any:
    """The shape from the library."""
    import build123d as b
    from bd_warehouse import fastener, o_rings, open_builds

    match row["class"]:
        case "Pipe":
            # The library's class asks for a material "steel" that it does not define.
            outer, length = size["d_mm"] / 2, size["length_mm"]
            return b.Cylinder(outer, length) - b.Cylinder(outer - size["wall_mm"], 2 * length)
        case "VSlotLinearRail":
            return open_builds.VSlotLinearRail(row["a"], size["length_mm"])  # pyright: ignore[reportArgumentType]
        case "ORing":
            return o_rings.ORing(row["a"])
        case "AluminumSpacer":
            return open_builds.AluminumSpacer(row["a"])  # pyright: ignore[reportArgumentType]
        case "ChamferedWasher":
            return fastener.ChamferedWasher(row["a"])
        case kind:
            return getattr(open_builds, kind)()


def _torus_pieces(extents: np.ndarray) -> list[np.ndarray]:
    """Pieces of a ring of round cross-section."""
    segments, sides = 18, 10
    thickness = float(extents[2])
    middle = (float(extents[0]) - thickness) / 2
    profile = s.balanced_polygon(thickness / 2, sides, np.pi / sides)
    swell = 2 / (1 + np.cos(np.pi / segments))
    rings = []
    for number in range(segments + 1):
        angle = 2 * np.pi * number / segments
        radius = swell * (middle + profile[:, 0])
        rings.append(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), profile[:, 1]]))
    return [np.concatenate(pair) for pair in zip(rings[:-1], rings[1:], strict=True)]
