"""Resting poses that a symmetry of the part carries into each other."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.alike_poses import PartSurface, alike_poses


def cloud(part: Part, number: int, turn: float = 0.0) -> np.ndarray:
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    points, _ = trimesh.sample.sample_surface(mesh, 20_000, seed=1)
    quat = quat_multiply(quat_about_z(np.asarray(turn)), part.resting.quat_wxyz[number])
    return Pose(position=np.zeros(3), quat_wxyz=quat).apply(np.asarray(points))


@pytest.mark.parametrize(("name", "distinct"), [("hex_nut_m20", 2), ("hex_bolt_m12x60", 2)])
def test_a_hexagon_has_one_pose_on_its_sides(name: str, distinct: int):
    part = find_part(name)
    alike = alike_poses(part)
    assert len(part.resting_probability) - len(alike) == distinct
    for number, (first, turn) in alike.items():
        assert first < number and first not in alike
        apart, _ = cKDTree(cloud(part, number)).query(cloud(part, first, turn))
        # Points drawn at random on one surface are that far from each other.
        assert np.quantile(apart, 0.95) < 1.5e-3


def test_an_angle_with_unequal_legs_has_no_two_poses_alike():
    assert alike_poses(find_part("l_bracket_60x40")) == {}


def test_a_nut_is_as_far_from_itself_as_it_was_raised_and_nowhere_after_a_sixth_of_a_turn():
    nut = find_part("hex_nut_m20")
    surface = PartSurface.of(nut)
    here = Pose(position=np.array([0.5, 0.1, 0.02]), quat_wxyz=nut.resting.quat_wxyz[0])
    turned = Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.array(np.pi / 3)))
    assert surface.apart(here, here) < 1e-6
    assert surface.apart(here, here @ turned) < 0.1e-3
    raised = Pose(position=here.position + [0.0, 0.0, 0.005], quat_wxyz=here.quat_wxyz)
    assert surface.apart(here, raised) == pytest.approx(0.005, abs=0.3e-3)
