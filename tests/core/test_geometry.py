import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from mskgrasp.core.geometry import (
    Pose,
    pixel_rays,
    pose_distance,
    quat_about_z,
    quat_conjugate,
    quat_from_matrix,
    quat_multiply,
    quat_rotate,
    quat_to_matrix,
    rotation_angle,
    straight_line,
    swing_vector,
    twist_and_swing,
    wrap_angle,
    wrap_half_turn,
)

settings.register_profile("mskgrasp", deadline=None, max_examples=60)
settings.load_profile("mskgrasp")

metres = st.floats(-2.0, 2.0)
angles = st.floats(-50.0, 50.0)
vectors = arrays(np.float64, 3, elements=metres)


@st.composite
def quats(draw: st.DrawFn) -> np.ndarray:
    quat = draw(arrays(np.float64, 4, elements=st.floats(-1.0, 1.0)))
    length = np.linalg.norm(quat)
    return quat / length if length > 1e-2 else np.array([1.0, 0.0, 0.0, 0.0])


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    return Pose(position=draw(vectors), quat_wxyz=draw(quats()))


def as_tensors(pose: Pose) -> Pose:
    return Pose(position=torch.from_numpy(pose.position), quat_wxyz=torch.from_numpy(pose.quat_wxyz))


@given(angles)
def test_a_wrapped_angle_is_the_same_direction_within_half_open_bounds(angle):
    wrapped = float(wrap_angle(angle))
    assert -np.pi <= wrapped < np.pi
    assert np.isclose(np.exp(1j * wrapped), np.exp(1j * angle), atol=1e-9)


@given(angles)
def test_a_wrapped_jaw_angle_is_the_same_line_within_half_open_bounds(angle):
    wrapped = float(wrap_half_turn(angle))
    assert -np.pi / 2 <= wrapped < np.pi / 2
    assert np.isclose(np.exp(2j * wrapped), np.exp(2j * angle), atol=1e-9)


@pytest.mark.parametrize("angle", [np.pi, -np.pi, 3 * np.pi, -1e-17, np.nextafter(np.pi, 0)])
def test_wrapping_stays_in_bounds_at_the_seam(angle):
    assert -np.pi <= float(wrap_angle(angle)) < np.pi


@given(quats(), quats(), vectors)
def test_quaternion_product_and_rotation_agree_with_scipy(left, right, point):
    first, second = (Rotation.from_quat(q, scalar_first=True) for q in (left, right))
    assert np.allclose(quat_rotate(left, point), first.apply(point), atol=1e-9)
    assert np.allclose(quat_to_matrix(quat_multiply(left, right)), (first * second).as_matrix(), atol=1e-9)


@given(quats())
def test_matrix_and_quaternion_are_inverses_up_to_sign(quat):
    again = quat_from_matrix(quat_to_matrix(quat))
    assert np.isclose(abs(again @ quat), 1.0)


@given(poses(), poses(), vectors)
def test_poses_compose_as_their_matrices_do(T_a_b, T_b_c, point):
    composed = T_a_b @ T_b_c
    assert np.allclose(composed.as_matrix(), T_a_b.as_matrix() @ T_b_c.as_matrix(), atol=1e-9)
    assert np.allclose(composed.apply(point), T_a_b.apply(T_b_c.apply(point)), atol=1e-9)


@given(poses())
def test_a_pose_times_its_inverse_changes_nothing(pose):
    assert np.allclose((pose @ pose.inverse()).as_matrix(), np.eye(4), atol=1e-9)
    assert np.allclose(Pose.from_matrix(pose.as_matrix()).as_matrix(), pose.as_matrix(), atol=1e-9)
    assert np.allclose(Pose.from_vector(pose.as_vector()).as_matrix(), pose.as_matrix())


@given(poses(), poses())
def test_numpy_and_torch_agree(first, second):
    tensor = as_tensors(first) @ as_tensors(second).inverse()
    array = first @ second.inverse()
    assert np.allclose(tensor.as_vector().numpy(), array.as_vector(), atol=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(0.0, 3.0), st.floats(-np.pi, np.pi))
def test_a_turn_about_z_then_a_tilt_splits_into_just_these(turn, tilt, direction):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    swing = np.concatenate([[np.cos(tilt / 2)], np.sin(tilt / 2) * axis])
    twist, swung = twist_and_swing(quat_multiply(swing, quat_about_z(np.array(turn))))
    assert np.isclose(twist, turn, atol=1e-6)
    assert np.isclose(swung, tilt, atol=1e-6)
    whole = quat_multiply(swing, quat_about_z(np.array(turn)))
    assert np.allclose(swing_vector(whole), tilt * axis[:2], atol=1e-6)
    assert np.allclose(swing_vector(torch.from_numpy(-whole)).numpy(), tilt * axis[:2], atol=1e-6)


@given(quats())
def test_twist_and_swing_do_not_depend_on_the_quaternions_sign(quat):
    twist, swing = twist_and_swing(quat)
    other_twist, other_swing = twist_and_swing(-quat)
    assert np.isclose(np.exp(1j * twist), np.exp(1j * other_twist), atol=1e-6)
    assert np.isclose(swing, other_swing)


def test_poses_broadcast_over_leading_axes():
    rng = np.random.default_rng(0)
    quat = rng.normal(size=(5, 1, 4))
    many = Pose(
        position=rng.normal(size=(5, 1, 3)), quat_wxyz=quat / np.linalg.norm(quat, axis=-1, keepdims=True)
    )
    points = rng.normal(size=(7, 3))
    assert many.apply(points).shape == (5, 7, 3)
    assert np.allclose(
        quat_rotate(quat_conjugate(many.quat_wxyz), many.apply(points) - many.position), points
    )


@given(poses(), vectors, vectors)
def test_a_pose_is_as_far_from_another_as_it_was_moved_and_turned(pose, step, turn):
    moved = Pose(
        position=pose.position + step,
        quat_wxyz=quat_multiply(Rotation.from_rotvec(turn).as_quat(scalar_first=True), pose.quat_wxyz),
    )
    metres, radians = pose_distance(pose, moved)
    assert np.isclose(metres, np.linalg.norm(step), atol=1e-9)
    angle = np.linalg.norm(turn) % (2 * np.pi)
    assert np.isclose(radians, min(angle, 2 * np.pi - angle), atol=1e-6)


@given(quats())
def test_the_angle_of_a_rotation_agrees_with_scipy(quat):
    expected = Rotation.from_quat(quat, scalar_first=True).magnitude()
    assert np.isclose(rotation_angle(quat), expected, atol=1e-7)
    assert np.isclose(rotation_angle(-quat), expected, atol=1e-7)


@given(poses(), vectors, vectors.filter(lambda turn: np.linalg.norm(turn) < 3.0))
def test_a_straight_line_moves_and_turns_at_a_constant_rate(start, step, turn):
    goal = Pose(
        position=start.position + step,
        quat_wxyz=quat_multiply(Rotation.from_rotvec(turn).as_quat(scalar_first=True), start.quat_wxyz),
    )
    shares = np.array([0.0, 0.3, 1.0])
    line = straight_line(start, goal, shares)
    assert np.allclose(line.position, start.position + shares[:, None] * step)
    for share, quat in zip(shares, line.quat_wxyz, strict=True):
        expected = Rotation.from_rotvec(share * turn) * Rotation.from_quat(start.quat_wxyz, scalar_first=True)
        assert np.allclose(quat_to_matrix(quat), expected.as_matrix(), atol=1e-7)


def test_a_point_on_the_ray_of_a_pixel_is_seen_in_that_pixel():
    intrinsics = np.array([[500.0, 0.0, 3.2], [0.0, 400.0, 1.7], [0.0, 0.0, 1.0]])
    rays = pixel_rays((4, 6), intrinsics)
    assert rays.shape == (4, 6, 3) and (rays[..., 2] == 1.0).all()
    seen = (0.7 * rays) @ intrinsics.T
    for row, column in np.ndindex(4, 6):
        assert np.allclose(seen[row, column, :2] / seen[row, column, 2], [column, row])
