"""Parts drawn by the vendors' libraries: listed without them, made true to the standards' numbers."""

import importlib.util
import math
import subprocess
import sys

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.recipes import cad, families
from mskgrasp.parts.recipes.cad import drawn, screws
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids.measure import aspect_ratio, hull_fit

needs_cad = pytest.mark.skipif(importlib.util.find_spec("bd_warehouse") is None, reason="needs [cad]")


@pytest.fixture(scope="module")
def listed() -> dict[str, Recipe]:
    return {recipe.name: recipe for recipe in cad.recipes()}


def made(listed, name):
    return listed[name].make(listed[name].dimensions)


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


def test_without_the_libraries_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "build123d", None)
    recipe = next(iter(drawn.recipes()))
    with pytest.raises(BadPart, match=r"pip install 'mskgrasp\[cad\]'"):
        recipe.make(recipe.dimensions)


@needs_cad
@pytest.mark.parametrize("family", sorted({recipe.family for recipe in screws.recipes()}))
def test_one_screw_of_each_family_is_closed_and_its_hulls_fit(listed, family):
    name = max(name for name, recipe in listed.items() if recipe.family == family)
    solid = made(listed, name)
    assert solid.mesh.is_watertight and solid.mesh.body_count == 1
    fit = hull_fit(solid.mesh, solid.hulls)
    assert fit.p95 <= 0.7
    assert 1 / 1.1 <= fit.volume_ratio <= 1.1
    for points in solid.hulls:
        assert len(points) <= 32
        assert aspect_ratio(points) <= 50
    size = listed[name].dimensions
    if family != "set_screw":
        assert -solid.mesh.bounds[0, 2] == pytest.approx(size["l_mm"], abs=0.01)


@needs_cad
def test_a_flange_bolt_has_the_numbers_of_en_1662(listed):
    # EN 1662, M10: width across flats 13, flange diameter 20.8 at most.
    mesh = made(listed, next(name for name in sorted(listed) if name.startswith("flange_bolt_m10"))).mesh
    top = np.asarray(mesh.vertices)[np.asarray(mesh.vertices)[:, 2] > 0.8 * mesh.bounds[1, 2]]
    assert 2 * np.hypot(top[:, 0], top[:, 1]).max() == pytest.approx(13 * 2 / math.sqrt(3), rel=0.03)
    assert 20 <= mesh.extents[:2].max() <= 20.8


@needs_cad
def test_a_pipe_weighs_what_its_section_says(listed):
    # ASME B36.10, 1 inch, schedule 40: 33.4 mm outside, wall 3.38 mm, 2.50 kg/m.
    mesh = made(listed, "pipe_1in_steelx85").mesh
    assert mesh.volume * 7850e-9 == pytest.approx(2.50 * 0.085, rel=0.01)


@needs_cad
def test_an_o_ring_is_a_torus_of_iso_3601(listed):
    # ISO 3601 size 325: inside diameter 37.47, cross-section 5.33.
    solid = made(listed, "o_ring_325")
    assert solid.mesh.volume == pytest.approx(math.pi**2 / 4 * 5.33**2 * (37.47 + 5.33), rel=0.02)
    assert hull_fit(solid.mesh, solid.hulls).p95 < 0.5


@needs_cad
def test_a_drawn_angle_has_its_fillet_and_bores(listed):
    solid = made(listed, "cast_angle_45x40")
    a, b, c, d, e, f = (listed["cast_angle_45x40"].dimensions[f"{key}_mm"] for key in "abcdef")
    legs = c * d * (a + b - d) + (1 - math.pi / 4) * e * e * c
    corners = 2 * (1 - math.pi / 4) * (c / 5) ** 2 * d
    expected = legs - corners - 2 * math.pi / 4 * f * f * d
    assert solid.mesh.volume == pytest.approx(expected, rel=0.01)
    assert solid.hulls == ()


@needs_cad
def test_the_same_part_has_the_same_bytes_when_drawn_again(listed):
    for name in ("cast_angle_45x40", max(name for name in listed if name.startswith("button_flange"))):
        first, second = made(listed, name), made(listed, name)
        assert first.mesh.vertices.tobytes() == second.mesh.vertices.tobytes()
        assert first.mesh.faces.tobytes() == second.mesh.faces.tobytes()
        assert [p.tobytes() for p in first.hulls] == [p.tobytes() for p in second.hulls]
