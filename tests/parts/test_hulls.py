"""Corners of a part's collision hulls, in metres and in the part's frame."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.parts import find_part
from mskgrasp.parts.hulls import hull_corners
from tests.boxes import make_box


def test_the_hull_of_a_box_has_its_corners(tmp_path):
    size = (0.04, 0.02, 0.03)
    (corners,) = hull_corners(make_box(tmp_path, "box", size, 0.1))
    assert corners.shape == (8, 3)
    expected = np.array(np.meshgrid(*([-edge / 2, edge / 2] for edge in size))).reshape(3, 8).T
    np.testing.assert_allclose(sorted(corners.tolist()), sorted(expected.tolist()), atol=1e-9)


@pytest.mark.parametrize("name", ["u_bracket_60x35", "hex_nut_m30"])
def test_hulls_are_as_many_and_as_large_as_the_part_says_and_enclose_its_mesh(name: str):
    part = find_part(name)
    hulls = hull_corners(part)
    assert len(hulls) == part.n_hulls > 1 and max(map(len, hulls)) <= 32
    assert sum(ConvexHull(hull).volume for hull in hulls) == pytest.approx(part.hulls_volume, rel=1e-4)
    mesh = trimesh.load_mesh(part.mesh_path)
    corners = np.concatenate(hulls)
    bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
    np.testing.assert_allclose(bounds, mesh.bounds, atol=part.hull_error + 1e-6)
