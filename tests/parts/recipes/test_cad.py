"""Recipes of CAD parts: listed without the libraries, under unique legal names."""

import subprocess
import sys

from mskgrasp.parts.recipes import cad, families


def test_listing_loads_neither_library():
    code = (
        "import sys; from mskgrasp.parts.recipes import cad; print(len(list(cad.recipes())), "
        "[name for name in sys.modules if name.startswith(('build123d', 'bd_warehouse', 'OCP'))])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    count, loaded = found.split(" ", 1)
    assert int(count) >= 200
    assert loaded.strip() == "[]"


def test_names_are_unique_legal_and_no_family_dominates(listed):
    recipes = list(cad.recipes())
    assert len(listed) == len(recipes)
    assert not set(listed) & set(families.recipes())
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789_-") for name in listed)
    kinds = [recipe.family for recipe in recipes]
    assert len(set(kinds)) >= 20
    assert max(kinds.count(kind) for kind in kinds) <= 300
    assert all("bd_warehouse" in r.source or "build123d" in r.source for r in recipes)
