"""Fields of a part, against its files."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import Pose
from mskgrasp.parts import Part


@pytest.fixture
def part(builtin_parts) -> Part:
    return builtin_parts["l_bracket_60x40"]


def test_the_mesh_is_in_metres_and_the_hulls_in_millimetres_of_one_frame(part: Part):
    mesh = trimesh.load_mesh(part.mesh_path)
    hulls = trimesh.load_scene(part.hulls_path)
    assert np.allclose(mesh.extents, part.extents, atol=1e-6) and 0.02 < part.longest_axis < 0.15
    assert np.allclose(1e-3 * hulls.bounds, mesh.bounds, atol=1e-3)
    assert len(hulls.geometry) == part.n_hulls


def test_every_stable_pose_stands_on_the_table_with_its_centre_of_mass_over_its_support(part: Part):
    corners = 1e-3 * np.concatenate([hull.vertices for hull in trimesh.load_scene(part.hulls_path).dump()])
    assert len(part.resting_probability) > 2
    for k in range(len(part.resting_probability)):
        pose = Pose(position=part.resting.position[k], quat_wxyz=part.resting.quat_wxyz[k])
        assert np.all(pose.position[:2] == 0)
        on_table = pose.apply(corners)
        assert on_table[:, 2].min() == pytest.approx(0, abs=1e-6)
        support = on_table[on_table[:, 2] < 2e-5, :2]
        assert len(support) >= 3
        assert (support.min(axis=0) < 0).all() and (support.max(axis=0) > 0).all()
