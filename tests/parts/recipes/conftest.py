"""Recipes of the CAD parts."""

import pytest

from mskgrasp.parts.recipes import cad
from mskgrasp.parts.recipes.recipe import Recipe


@pytest.fixture(scope="module")
def listed() -> dict[str, Recipe]:
    return {recipe.name: recipe for recipe in cad.recipes()}
