"""Parts drawn with build123d and bd_warehouse, the extra ``[cad]``; listing them loads neither."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Iterator

from mskgrasp.parts.recipes.cad import drawn, screws, stock
from mskgrasp.parts.recipes.recipe import Recipe

VENDORS = ("build123d", "bd_warehouse")


def available() -> bool:
    """Whether the extra ``[cad]`` is installed."""
    return all(importlib.util.find_spec(name) is not None for name in VENDORS)


def package_versions() -> dict[str, str]:
    """Versions of the libraries, on which the shapes depend."""
    return {name: importlib.metadata.version(name) for name in VENDORS}


def recipes() -> Iterator[Recipe]:
    """Recipes of all CAD modules."""
    for module in (drawn, screws, stock):
        yield from module.recipes()
