"""Recipes from rows of a table."""

from mskgrasp.parts.recipes.families.listing import OWN, one
from mskgrasp.parts.recipes.recipe import STEEL
from mskgrasp.parts.solids import solid as s


def block(size: dict[str, float]) -> s.Solid:
    return s.solid(s.extrude(s.rectangle(0, size["a_mm"], 0, size["b_mm"]), 0, 10), [])


def test_a_recipe_is_named_for_its_row_and_its_maker():
    recipe = one({"a_mm": 12.5, "b_mm": 40.0}, "block_{a}x{b}", block)
    assert (recipe.name, recipe.family) == ("block_12p5x40", "block")
    assert (recipe.source, recipe.density) == (OWN, STEEL)
    assert recipe.make(recipe.dimensions).mesh.volume == 12.5 * 40 * 10
    assert one({"a_mm": 1.0}, "pad_{a}", block, family="pad").family == "pad"
