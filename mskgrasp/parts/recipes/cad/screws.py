"""Screws of further types from bd_warehouse; head at z = 0, shank below.

Threads are cylinders of their minor diameter, as bd_warehouse draws the core.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import trimesh

from mskgrasp.parts.recipes.cad.brep import Row, lengths, mesh_of, needs_cad, table
from mskgrasp.parts.recipes.cad.hulls import headed_hulls, turned_hulls
from mskgrasp.parts.recipes.recipe import STEEL, Recipe
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.measure import hull_fit

STANDARDS = {
    "OpenBuilds": "OpenBuilds",
    "asme_b18.3": "ASME B18.3",
    "asme_b_18.6.3": "ASME B18.6.3",
    "din1662": "EN 1662",
    "din1665": "EN 1665",
    "din967": "DIN 967",
    "iso1207": "ISO 1207",
    "iso14580": "ISO 14580",
    "iso14583": "ISO 14583",
    "iso1580": "ISO 1580",
    "iso2009": "ISO 2009",
    "iso2010": "ISO 2010",
    "iso4026": "ISO 4026",
    "iso7045": "ISO 7045",
    "iso7380_2": "ISO 7380-2",
}
"""Standard of each type of the library; what it calls DIN 1662 and DIN 1665 are the EN standards."""

_CLOSE_MM = 0.35
_CLOSE_RATIO = 1.05


def recipes() -> Iterator[Recipe]:
    """One part for each row of the table."""
    for row in table("screws.csv"):
        yield Recipe(
            name=row["name"],
            family=row["family"],
            source=f"{STANDARDS[row['type']]} {row['size']}, bd_warehouse 0.4.0",
            density=STEEL,
            dimensions=lengths(row),
            make=_maker(row),
        )


def _maker(row: Row) -> Callable[[dict[str, float]], s.Solid]:
    @needs_cad
    def make(size: dict[str, float]) -> s.Solid:
        from bd_warehouse import fastener

        screw: Any = getattr(fastener, row["class"])
        mesh = mesh_of(screw(row["size"], size["l_mm"], row["type"], simple=True))
        return s.Solid(mesh=mesh, hulls=tuple(screw_hulls(mesh, hexagonal="Hex" in row["class"])))

    return make


def screw_hulls(mesh: trimesh.Trimesh, *, hexagonal: bool) -> list[Any]:
    """Pieces of a screw; its socket is filled where it is a small part of the surface."""
    if hexagonal:
        return headed_hulls(mesh)
    filled = turned_hulls(mesh, filled=True)
    fit = hull_fit(mesh, filled)
    close = fit.p95 <= _CLOSE_MM and 1 / _CLOSE_RATIO <= fit.volume_ratio <= _CLOSE_RATIO
    return filled if close else turned_hulls(mesh)
