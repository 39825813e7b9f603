"""Mass, size and hull fit against formulas."""

import numpy as np
import pytest
import trimesh

from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.measure import aspect_ratio, hull_fit, longest_axis, mass_properties


def test_a_box_has_the_mass_and_inertia_of_the_formula_about_its_centroid():
    box = trimesh.creation.box((40, 30, 20))
    box.apply_translation((100, 0, -50))
    found = mass_properties(box, 1000.0)
    assert found.mass == pytest.approx(0.024) and found.volume == pytest.approx(24e-6)
    assert np.allclose(found.centroid, [0.1, 0, -0.05])
    a, b, c = 0.04, 0.03, 0.02
    expected = 0.024 / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert np.allclose(found.inertia, expected, rtol=1e-6, atol=1e-12)
    assert np.allclose(found.quat_principal, [1, 0, 0, 0])


@pytest.mark.parametrize("far", [1e5, 1e6, 1e7])
def test_mass_and_inertia_do_not_depend_on_the_distance_from_the_origin(far):
    ring = trimesh.creation.annulus(10, 20, 15)
    here = mass_properties(ring, 7850)
    ring.apply_translation((far, -far, far / 3))
    found = mass_properties(ring, 7850)
    assert found.mass == pytest.approx(here.mass, rel=1e-6)
    assert np.allclose(found.inertia, here.inertia, rtol=1e-5, atol=1e-5 * here.inertia.max())
    assert np.allclose(1000 * found.centroid, [far, -far, far / 3], rtol=0, atol=1e-4)


def test_the_longest_axis_does_not_depend_on_the_orientation():
    box = trimesh.creation.box((60, 20, 10))
    box.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3)))
    assert longest_axis(box) == pytest.approx(60, rel=1e-6)


def test_the_fit_is_the_distance_by_which_a_hull_stands_off():
    box = trimesh.creation.box((40, 30, 20))
    assert hull_fit(box, [s.box(-20, 20, -15, 15, -10, 10)]).largest == pytest.approx(0, abs=1e-6)
    fit = hull_fit(box, [s.box(-20, 20, -15, 15, -10, 11)])
    assert fit.outward_largest == pytest.approx(1) == pytest.approx(fit.inward_largest)
    assert fit.volume_ratio == pytest.approx(21 / 20)


def test_the_aspect_ratio_is_the_diagonal_over_the_thickness():
    assert aspect_ratio(s.box(0, 30, 0, 40, 0, 10)) == pytest.approx(np.sqrt(30**2 + 40**2 + 10**2) / 10)
