"""Recipes from the rows of a dimension table."""

from __future__ import annotations

from collections.abc import Iterator

from mskgrasp.parts.recipes.recipe import STEEL, Recipe, table
from mskgrasp.parts.solids.solid import Maker

OWN = "own dimensions"

BRASS = 8500.0
CAST_IRON = 7200.0
POLYAMIDE = 1140.0
POLYOXYMETHYLENE = 1410.0
POLYURETHANE = 1200.0


def one_per_row(
    file_name: str, name: str, make: Maker, *, source: str = OWN, density: float = STEEL, family: str = ""
) -> Iterator[Recipe]:
    """A recipe for every row of a table.

    Args:
        file_name: File name of the table.
        name: Format string over the columns without their ``_mm``; a decimal point becomes a p.
        make: Makes a solid of a row.
        source: The standard, or another origin of the dimensions.
        density: kg/m^3.
        family: Kind of part; the name of ``make`` without one.
    """
    for row in table(file_name):
        yield one(row, name, make, source=source, density=density, family=family)


def one(
    row: dict[str, float],
    name: str,
    make: Maker,
    *,
    source: str = OWN,
    density: float = STEEL,
    family: str = "",
) -> Recipe:
    """A recipe for one row; arguments as above."""
    words = {key.removesuffix("_mm"): f"{value:g}".replace(".", "p") for key, value in row.items()}
    if not family:
        family = getattr(make, "__name__", "")
    return Recipe(
        name=name.format(**words), family=family, source=source, density=density, dimensions=row, make=make
    )
