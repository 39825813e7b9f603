"""Pipes and rings of bd_warehouse against the numbers of their standards."""

import math

import pytest

from mskgrasp.parts.solids.measure import hull_fit
from tests.parts.recipes.cad.made_parts import made, needs_cad


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
