"""Recipe of a built-in part."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.parts.solids.solid import Maker

STEEL = 7850.0
BRONZE = 8800.0
ALUMINIUM = 2700.0

TABLES = Path(__file__).parent / "families" / "tables"


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that determines a built-in part.

    Attributes:
        name: The part's name.
        family: Kind of part.
        source: The standard, or another origin of the dimensions.
        density: kg/m^3.
        dimensions: Argument of ``make``: lengths in millimetres under names that end in ``_mm``, counts.
        make: Makes a solid of the dimensions; one without hulls is decomposed.
        licence: SPDX identifier.
        version: Raised when `make` gives another shape for the same dimensions.
    """

    name: str
    family: str
    source: str
    density: float
    dimensions: dict[str, float]
    make: Maker
    licence: str = "Apache-2.0"
    version: int = 1


def table(file_name: str) -> list[dict[str, float]]:
    """The rows of a dimension table; lines that begin with # explain the columns."""
    with open(TABLES / file_name, encoding="utf-8", newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: float(value) for key, value in row.items()} for row in rows]


def table_row(file_name: str, **key: float) -> dict[str, float]:
    """The row whose columns have the given values.

    Raises:
        KeyError: The table has no such row.
    """
    for row in table(file_name):
        if all(row[column] == value for column, value in key.items()):
            return row
    raise KeyError(f"{file_name} has no row with {key}")
