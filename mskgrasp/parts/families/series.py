"""A series: one family of parts in all the sizes of one table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mskgrasp.parts.families.recipe import Recipe, table
from mskgrasp.parts.solid import Maker


@dataclass(frozen=True, kw_only=True)
class Series:
    """One family, or one variant of a family, with a table of sizes.

    Attributes:
        family: Kind of part.
        name: Of each part, a format string over the table's columns: ``clevis_{d_mm:g}x{g_mm:g}``.
        table: File of sizes.
        density: kg/m^3.
        make: Turns one row of the table into a shape.
        source: The standard, or what stands in for one.
    """

    family: str
    name: str
    table: str
    density: float
    make: Maker
    source: str = "own dimensions"

    def recipes(self) -> Iterator[Recipe]:
        """One recipe for each row."""
        for row in table(self.table):
            yield Recipe(
                name=self.name.format(**row).replace(".", "p"),
                family=self.family,
                source=self.source,
                density=self.density,
                dimensions=row,
                make=self.make,
            )
