"""Meshes of exact shapes: the same bytes each time, and an error that names the extra."""

import sys

import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.recipes.cad import drawn
from tests.parts.recipes.cad.made_parts import made, needs_cad


def test_without_the_libraries_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "build123d", None)
    recipe = next(iter(drawn.recipes()))
    with pytest.raises(BadPart, match=r"EXTRAS=dev,cad"):
        recipe.make(recipe.dimensions)


@needs_cad
def test_the_same_part_has_the_same_bytes_when_drawn_again(listed):
    for name in ("cast_angle_45x40", max(name for name in listed if name.startswith("button_flange"))):
        first, second = made(listed, name), made(listed, name)
        assert first.mesh.vertices.tobytes() == second.mesh.vertices.tobytes()
        assert first.mesh.faces.tobytes() == second.mesh.faces.tobytes()
        assert [p.tobytes() for p in first.hulls] == [p.tobytes() for p in second.hulls]
