"""Altered parts differ in what was altered, and in nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from mskgrasp.core.geometry import Pose, quat_multiply
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.validate.altered_part import FILLED_MM, altered_part, mesh_rests, resting_start


def test_another_density_scales_mass_and_inertia_alone(tmp_path):
    part = find_part("hex_nut_m20")
    heavy = altered_part(part, tmp_path, density=2.0)
    assert heavy.mass == pytest.approx(2 * part.mass)
    np.testing.assert_allclose(heavy.inertia, 2 * part.inertia, rtol=1e-6, atol=1e-15)
    for own, other in zip(hull_corners(part), hull_corners(heavy), strict=True):
        np.testing.assert_allclose(own, other, atol=1e-8)
    assert heavy.content_hash != part.content_hash and find_part("hex_nut_m20").mass == part.mass


@pytest.mark.slow
def test_joining_within_a_larger_distance_leaves_fewer_hulls(tmp_path):
    part = find_part("u_bolt_nuts_m6x18x50")
    exact, fine, coarse = (
        altered_part(part, tmp_path / name.replace(" ", ""), hulls=name)
        for name in ("exact", "0.1 mm", "0.7 mm")
    )
    assert exact.n_hulls >= fine.n_hulls >= coarse.n_hulls and exact.n_hulls > coarse.n_hulls
    # The mesh, and what follows from it, is the same: so is the frame.
    assert exact.mass == pytest.approx(part.mass) and coarse.mass == pytest.approx(part.mass)
    np.testing.assert_allclose(exact.inertia, part.inertia, rtol=1e-5, atol=1e-12)


def occupied(part: Part) -> float:
    """Volume of the union of a part's hulls, m^3."""
    pieces = [Manifold.hull_points(1e3 * corners) for corners in hull_corners(part)]
    return 1e-9 * Manifold.batch_boolean(pieces, OpType.Add).volume()


def test_a_bore_of_a_plate_is_open_or_filled(tmp_path):
    part = find_part("lifting_lug_104x76")
    opened, filled = (altered_part(part, tmp_path / name[6:], hulls=name) for name in FILLED_MM)
    bore = np.pi / 4 * part.dimensions["bore"] ** 2 * part.dimensions["t"]
    assert occupied(filled) - occupied(opened) == pytest.approx(bore, rel=0.05)  # the bore is a polygon
    assert filled.n_hulls < opened.n_hulls and filled.mass == pytest.approx(opened.mass)


@pytest.mark.parametrize("turn", [-3.0, -1.2, 0.0, 0.4, 2.5])
def test_a_start_keeps_its_place_and_turn_in_the_nearest_resting_pose(turn):
    part = find_part("l_bracket_40x40")
    rests = part.resting
    about_z = np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    lean = np.array([np.cos(0.02), np.sin(0.02), 0, 0])
    for k in range(len(rests.quat_wxyz)):
        exact = quat_multiply(about_z, rests.quat_wxyz[k])
        start = np.array([0.5, 0.1, 0.02, *quat_multiply(lean, exact)])
        found = resting_start(start, rests)
        assert found[:3] == pytest.approx([0.5, 0.1, rests.position[k, 2]])
        assert abs(found[3:] @ exact) == pytest.approx(1, abs=1e-6)


def test_a_start_far_from_every_resting_pose_is_left_alone():
    rests = Pose(position=np.array([[0, 0, 0.01]]), quat_wxyz=np.array([[1.0, 0, 0, 0]]))
    start = np.array([0.5, 0.1, 0.02, np.cos(0.5), np.sin(0.5), 0, 0])
    np.testing.assert_array_equal(resting_start(start, rests), start)


def test_resting_poses_of_a_convex_part_are_those_of_its_hulls():
    part = find_part("hex_nut_m20")
    heights = sorted(np.round(1e3 * mesh_rests(part).position[:, 2], 1))
    assert heights[0] == pytest.approx(min(1e3 * part.resting.position[:, 2]), abs=0.1)
