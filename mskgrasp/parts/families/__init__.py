"""The built-in families of parts; each module holds the families that are built alike."""

from __future__ import annotations

from functools import lru_cache

from mskgrasp.parts.families import brackets, fasteners, gears, pins, rings
from mskgrasp.parts.families.recipe import Recipe


@lru_cache(maxsize=1)
def recipes() -> dict[str, Recipe]:
    """All built-in parts by name, sorted."""
    found = [recipe for module in (brackets, fasteners, gears, pins, rings) for recipe in module.recipes()]
    return {recipe.name: recipe for recipe in sorted(found, key=lambda recipe: recipe.name)}
