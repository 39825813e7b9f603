"""Stable poses against what one can work out by hand."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.parts.solids.stable_poses import stable_poses


def box_corners(x: float, y: float, z: float) -> np.ndarray:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return signs * np.array([x, y, z]) / 2


def down(quats: np.ndarray) -> np.ndarray:
    """The direction in obj that points to the table."""
    return -quat_to_matrix(quats)[:, 2]


@pytest.mark.slow
def test_the_lowest_hull_corner_of_every_pose_touches_the_table(builtin_parts):
    for part in builtin_parts.values():
        points = np.concatenate([h.vertices for h in trimesh.load_scene(part.hulls_path).dump()]) / 1000
        posed = part.resting.as_matrix()[:, :3, :3] @ points.T + part.resting.position[:, :, None]
        assert np.abs(posed[:, 2].min(axis=1)).max() < 1e-6, part.name


def test_probabilities_fall_sum_to_one_and_leave_out_the_rare(builtin_parts):
    for part in [builtin_parts[name] for name in list(builtin_parts)[::5]]:
        probability = part.resting_probability
        assert probability.sum() == pytest.approx(1.0, abs=1e-9)
        assert (np.diff(probability) <= 1e-12).all()
        assert probability[-1] >= 0.005 and 1 <= len(probability) <= 64
        assert np.array_equal(part.resting.position[:, :2], np.zeros((len(probability), 2)))


def test_a_cube_rests_on_each_face_equally_often():
    poses, probability = stable_poses(box_corners(30, 30, 30))
    assert np.allclose(probability, np.full(6, 1 / 6))
    assert np.allclose(poses.position[:, 2], 0.015)
    assert np.allclose(np.abs(down(poses.quat_wxyz)).max(axis=1), 1.0)


def test_a_box_rests_on_a_face_as_often_as_the_face_is_seen_from_its_centre():
    x, y, z = 40.0, 30.0, 10.0
    poses, probability = stable_poses(box_corners(x, y, z))
    a, b, d = x / 2, y / 2, z / 2
    # Solid angle of a rectangle 2a x 2b at distance d, over 4 pi.
    expected = np.arctan(a * b / (d * np.sqrt(a * a + b * b + d * d))) / np.pi
    flat = np.abs(down(poses.quat_wxyz)[:, 2]) > 0.999
    assert np.allclose(probability[flat], expected)
    assert np.allclose(poses.position[flat, 2], 0.005)


def test_a_leaning_tower_never_stands():
    # The top is shifted so far that the centroid lies beside the base.
    corners = np.concatenate([box_corners(10, 10, 0) + [-12, 0, -20], box_corners(10, 10, 0) + [12, 0, 20]])
    poses, _ = stable_poses(corners)
    assert (np.abs(down(poses.quat_wxyz)[:, 2]) < 0.99).all()


def test_a_pose_that_a_breath_would_tip_is_left_out():
    # The centre of mass projects 0.2 mm inside one border of the base: too little to count on.
    corners = box_corners(20, 20, 60) + [9.8, 0, 0]
    poses, _ = stable_poses(corners)
    assert (np.abs(down(poses.quat_wxyz)[:, 2]) < 0.99).all()
    corners = box_corners(20, 20, 60) + [9.5, 0, 0]
    poses, _ = stable_poses(corners)
    assert (np.abs(down(poses.quat_wxyz)[:, 2]) > 0.99).any()


def test_a_washer_lies_flat(builtin_parts):
    part = builtin_parts["washer_m36"]
    assert part.resting_probability[:2].sum() > 0.95
    assert np.allclose(part.resting.position[:2, 2], 0.0025, atol=1e-6)


def test_a_pin_lies_on_its_side(builtin_parts):
    part = builtin_parts["parallel_pin_20x100"]
    axis = quat_to_matrix(part.resting.quat_wxyz)[:, 2, 2]
    assert part.resting_probability[np.abs(axis) < 0.01].sum() > 0.95
