import numpy as np
import pytest
import torch
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, wrap_angle
from mskgrasp.core.grasp import (
    Grasp,
    PartView,
    centre_in_grasp_frame,
    lowest_grasp_z,
    object_displacement,
    pose_base_grasp,
    pose_base_tcp,
    sample_grasps,
    swing_in_hand,
    to_grasp_displacement,
    to_object_displacement,
)
from tests.core.test_geometry import poses, vectors
from tests.synthetic import displaced

shifts = st.tuples(*[st.floats(-0.1, 0.1)] * 3, st.floats(-3.1, 3.1)).map(np.array)
grasps = st.tuples(*[st.floats(-0.7, 0.7)] * 3, st.floats(-1.57, 1.57)).map(np.array)
centres = arrays(np.float64, 3, elements=st.floats(-0.2, 0.2))


def same(first: np.ndarray, second: np.ndarray) -> bool:
    difference = first - second
    difference[..., 3] = wrap_angle(difference[..., 3])
    return bool(np.allclose(difference, 0, atol=1e-9))


@given(grasps, shifts, st.tuples(*[st.floats(-1.0, 1.0)] * 2).map(np.array), poses())
def test_a_part_that_swings_in_the_hand_has_that_swing_in_the_grasp_frame(grasp, shift, swing, part):
    angle = np.linalg.norm(swing)
    half = np.sinc(angle / (2 * np.pi)) / 2  # sin(angle / 2) / angle
    swung = np.concatenate([[np.cos(angle / 2)], half * swing, [0.0]])
    turn = quat_multiply(swung, quat_about_z(shift[3]))
    T_base_grasp, T_tcp_base = pose_base_grasp(grasp), pose_base_tcp(grasp).inverse()
    moved = T_base_grasp @ Pose(position=shift[:3], quat_wxyz=turn) @ T_base_grasp.inverse() @ part
    found = swing_in_hand(T_tcp_base @ part, T_tcp_base @ moved)
    assert np.allclose(found, swing, atol=1e-6)
    _, tilt = object_displacement(T_tcp_base @ part, T_tcp_base @ moved)
    assert np.isclose(tilt, angle, atol=1e-6)


@given(grasps)
def test_the_tcp_points_down_and_closes_along_the_grasp_frames_y(grasp):
    T_base_tcp, T_base_grasp = pose_base_tcp(grasp).as_matrix(), pose_base_grasp(grasp).as_matrix()
    assert np.allclose(T_base_tcp[:3, 2], [0, 0, -1])
    assert np.allclose(T_base_tcp[:3, 1], -T_base_grasp[:3, 1])
    closing = [-np.sin(grasp[3]), np.cos(grasp[3]), 0]
    assert np.allclose(T_base_grasp[:3, 1], closing)
    assert np.allclose(T_base_tcp[:3, 3], grasp[:3])


@given(shifts, centres)
def test_object_and_grasp_displacement_are_inverses(displacement, centre):
    assert same(to_object_displacement(to_grasp_displacement(displacement, centre), centre), displacement)
    assert same(to_grasp_displacement(to_object_displacement(displacement, centre), centre), displacement)


@given(shifts, centres)
def test_numpy_and_torch_convert_displacements_alike(displacement, centre):
    array = to_grasp_displacement(displacement, centre)
    tensor = to_grasp_displacement(torch.from_numpy(displacement), torch.from_numpy(centre))
    assert np.allclose(tensor.numpy(), array, atol=1e-12)


@given(centres, st.floats(-3.0, 3.0))
def test_a_part_that_turns_about_the_hand_is_a_hand_that_only_turns_the_other_way(centre, turn):
    turned = Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.array(turn))).apply(centre)
    displacement = np.append(turned - centre, turn)
    assert same(to_grasp_displacement(displacement, centre), np.array([0, 0, 0, -turn]))


@given(shifts, centres)
def test_grasp_displacement_is_the_motion_of_the_hand_seen_from_the_part(displacement, centre):
    # The part's frame before and after, seen from the hand; the hand's motion follows by inverting them.
    before = Pose(position=centre, quat_wxyz=quat_about_z(np.array(0.0)))
    after = Pose(position=centre + displacement[:3], quat_wxyz=quat_about_z(displacement[3]))
    moved = before @ after.inverse()
    expected = np.append(moved.position, -displacement[3])
    assert same(to_grasp_displacement(displacement, centre), expected)


@given(shifts, st.floats(0.0, 0.5), st.floats(-np.pi, np.pi), centres, centres)
def test_every_point_of_a_rigid_part_gives_the_same_grasp_displacement_up_to_the_tilt(
    motion, tilt, direction, first, second
):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    swing = np.concatenate([[np.cos(tilt / 2)], np.sin(tilt / 2) * axis])
    moved = Pose(position=motion[:3], quat_wxyz=quat_multiply(swing, quat_about_z(motion[3])))
    one, other = (
        to_grasp_displacement(np.append(moved.apply(point) - point, motion[3]), point)
        for point in (first, second)
    )
    assert one[3] == other[3]
    apart = 2 * np.sin(tilt / 2) * np.linalg.norm(first - second)
    assert np.linalg.norm(one[:3] - other[:3]) <= apart + 1e-12


@given(poses(), shifts)
def test_a_displacement_put_into_the_hand_is_measured(T_tcp_obj, displacement):
    measured, tilt = object_displacement(T_tcp_obj, displaced(T_tcp_obj, displacement))
    assert same(measured, displacement)
    assert tilt < 1e-6


@given(poses(), poses(), grasps)
def test_displacement_does_not_depend_on_where_the_hand_is(before, after, grasp):
    T_base_tcp = pose_base_tcp(grasp)
    first, _ = object_displacement(before, after)
    again, _ = object_displacement(*(T_base_tcp.inverse() @ (T_base_tcp @ pose) for pose in (before, after)))
    assume(abs(abs(first[3]) - np.pi) > 1e-6)
    assert np.allclose(first, again, atol=1e-6)


@given(poses(), st.floats(0.01, 1.5), st.floats(-np.pi, np.pi))
def test_a_pure_tilt_is_reported_as_tilt_and_not_as_a_turn(T_tcp_obj, tilt, direction):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    swing = np.concatenate([[np.cos(tilt / 2)], np.sin(tilt / 2) * axis])
    tilted = Pose(position=T_tcp_obj.position, quat_wxyz=quat_multiply(swing, T_tcp_obj.quat_wxyz))
    displacement, measured = object_displacement(T_tcp_obj, tilted)
    assert np.allclose(displacement, 0, atol=1e-6)
    assert np.isclose(measured, tilt)


@given(grasps, vectors)
def test_the_centre_in_the_grasp_frame_is_undone_by_the_grasps_pose(grasp, centre):
    seen = centre_in_grasp_frame(centre, grasp)
    assert np.allclose(pose_base_grasp(grasp).apply(seen), centre)


def a_view(height: float) -> PartView:
    yaw = 0.7
    return PartView(
        centre_base=np.array([0.5, 0.1, 0.02 + height / 2]),
        T_base_box=Pose(position=np.array([0.5, 0.1, 0.02]), quat_wxyz=quat_about_z(np.array(yaw))),
        size=np.array([0.06, 0.02, height]),
        gyration_radius=0.02,
        table_z=0.02,
    )


def test_sampled_grasps_fill_the_box_and_keep_off_the_table():
    view = a_view(0.04)
    sampled = sample_grasps(view, 4000, np.random.default_rng(0))
    inside = view.T_base_box.inverse().apply(sampled[:, :3])
    assert np.all(np.abs(inside[:, :2]) <= view.size[:2] / 2)
    assert np.all(np.abs(inside[:, :2]).max(axis=0) > 0.98 * view.size[:2] / 2)
    assert sampled[:, 2].min() >= lowest_grasp_z(view.table_z)
    assert 0.058 < sampled[:, 2].max() <= 0.06
    assert -np.pi / 2 <= sampled[:, 3].min() < -1.55 and 1.55 < sampled[:, 3].max() < np.pi / 2


def test_a_flat_part_is_grasped_at_the_lowest_height():
    sampled = sample_grasps(a_view(0.003), 10, np.random.default_rng(0))
    assert np.all(sampled[:, 2] == pytest.approx(lowest_grasp_z(0.02)))


def test_seed_zero_is_a_seed():
    first, second, other = (sample_grasps(a_view(0.04), 5, np.random.default_rng(s)) for s in (0, 0, 1))
    assert np.array_equal(first, second) and not np.array_equal(first, other)


def test_grasps_are_batched_and_their_vectors_and_frames_agree_with_arrays():
    vectors = np.random.default_rng(0).uniform(-1, 1, (5, 3, 4))
    grasps = Grasp.from_vector(vectors)
    np.testing.assert_array_equal(grasps.as_vector(), vectors)
    np.testing.assert_array_equal(grasps[2, 1].as_vector(), vectors[2, 1])
    assert len(grasps) == 5
    closing = grasps.T_base_grasp.apply(np.array([0.0, 1.0, 0.0])) - grasps.position
    np.testing.assert_allclose(
        closing, np.stack([-np.sin(grasps.theta), np.cos(grasps.theta), 0 * grasps.theta], -1), atol=1e-12
    )
    down = grasps.T_base_tcp.apply(np.array([0.0, 0.0, 1.0])) - grasps.position
    np.testing.assert_allclose(down, np.broadcast_to([0, 0, -1.0], down.shape), atol=1e-12)


def test_a_raised_grasp_is_higher_and_nothing_else():
    grasp = Grasp.from_vector(np.array([0.5, 0.1, 0.02, 0.3]))
    np.testing.assert_allclose(grasp.raised(0.1).as_vector(), [0.5, 0.1, 0.12, 0.3])


def test_a_vector_that_is_no_grasp_is_refused_with_its_shape():
    with pytest.raises(ValueError, match=r"x y z theta, shape \(\.\.\., 4\), got shape \(7,\)"):
        Grasp.from_vector(np.zeros(7))
