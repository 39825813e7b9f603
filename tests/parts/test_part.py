"""Fields of a part, against its files."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import Pose
from mskgrasp.parts import Part
from mskgrasp.parts.part import FINE_P95_MM, FINE_VOLUME_RATIO


@pytest.fixture
def part(builtin_parts) -> Part:
    return builtin_parts["l_bracket_60x40"]


def test_the_mesh_is_in_metres_and_the_hulls_in_millimetres_of_one_frame(part: Part):
    mesh = trimesh.load_mesh(part.mesh_path)
    hulls = trimesh.load_scene(part.hulls_path)
    assert np.allclose(mesh.extents, part.extents, atol=1e-6) and 0.02 < part.longest_axis < 0.15
    assert np.allclose(1e-3 * hulls.bounds, mesh.bounds, atol=1e-3)
    assert len(hulls.geometry) == part.n_hulls


def test_a_part_is_fine_within_both_bounds_and_coarse_beyond_either(part: Part):
    assert part.grade == "fine"
    bound, ratio = 1e-3 * FINE_P95_MM, FINE_VOLUME_RATIO
    for p95, volume, grade in (
        (bound, ratio, "fine"),
        (bound, 1 / ratio + 1e-6, "fine"),
        (1.01 * bound, 1.0, "coarse"),
        (0.0, 1.01 * ratio, "coarse"),
        (0.0, 0.99 / ratio, "coarse"),
    ):
        assert replace(part, hull_error_p95=p95, hull_volume_ratio=volume).grade == grade


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
