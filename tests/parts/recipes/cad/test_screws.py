"""Screws of bd_warehouse against the numbers of their standards."""

import math

import numpy as np
import pytest

from mskgrasp.parts.recipes.cad import screws
from mskgrasp.parts.solids.measure import aspect_ratio, hull_fit
from tests.parts.recipes.cad.made_parts import made, needs_cad

FAMILIES = sorted({recipe.family for recipe in screws.recipes()})


@needs_cad
@pytest.mark.parametrize(
    "family",
    [
        *FAMILIES[::4],
        *(pytest.param(one, marks=pytest.mark.slow) for one in FAMILIES if one not in FAMILIES[::4]),
    ],
)
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
