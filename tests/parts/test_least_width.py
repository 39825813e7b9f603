"""Distances between the faces by which fingers could hold a part."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from mskgrasp.parts.importing.import_file import import_part
from mskgrasp.parts.least_width import FRICTION, least_widths


@pytest.fixture
def imported(tmp_path, monkeypatch):
    """A part made of a mesh in millimetres."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def make(mesh: trimesh.Trimesh):
        mesh.export(tmp_path / "shape.stl")
        return import_part(tmp_path / "shape.stl", unit="mm")

    return make


def test_a_box_is_as_wide_as_its_least_horizontal_edge(imported):
    part = imported(trimesh.creation.box([120.0, 60.0, 90.0]))
    widths = least_widths(part)
    lowest = part.resting.position[:, 2]  # half of the vertical edge
    expected = np.where(np.isclose(lowest, 0.03, atol=1e-3), 0.09, 0.06)
    assert len(set(expected)) == 2  # it rests on different faces
    np.testing.assert_allclose(widths, expected, atol=1e-4)


def test_a_ball_is_held_beside_its_centre_as_far_as_friction_allows(imported):
    # A chord at the angle of friction to both normals has 2 r / sqrt(1 + mu^2), and is as steep as that.
    part = imported(trimesh.creation.icosphere(subdivisions=4, radius=50.0))
    assert least_widths(part).min() == pytest.approx(0.1 / (1 + FRICTION**2), rel=0.03)


@pytest.mark.slow
def test_a_wall_of_a_wide_cup_is_thin(imported):
    part = imported(trimesh.creation.annulus(r_min=56.0, r_max=60.0, height=80.0))
    upright = np.isclose(part.resting.position[:, 2], 0.04, atol=1e-3)
    np.testing.assert_allclose(least_widths(part)[upright], 0.004, atol=2e-4)
