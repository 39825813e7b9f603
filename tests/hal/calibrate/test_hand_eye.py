"""The solver on synthetic corners whose truth is known, and what it refuses."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hal.calibrate.board_poses import Sight, candidate_poses
from hal.calibrate.hand_eye import BadCalibrationSet, HandEye, View, solve_hand_eye, spread
from hal.charuco import Board, Corners, project
from mskgrasp.core.geometry import Pose, pose_distance

BOARD = Board()
INTRINSICS = np.array([[365.456, 0, 256.1], [0, 365.456, 205.4], [0, 0, 1.0]])
"""A Kinect v2's, its image not mirrored."""
OVERHEAD = Pose(
    position=np.array([0.52, 0.03, 1.05]),
    quat_wxyz=(
        Rotation.from_euler("xyz", [3.0, -2.0, 4.0], degrees=True)
        * Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    ).as_quat(scalar_first=True),
)
HELD = Pose(
    position=np.array([0.165, 0.004, -0.012]),
    quat_wxyz=Rotation.from_euler("xyz", [2.0, -3.0, 5.0], degrees=True).as_quat(scalar_first=True),
)


def hand_poses(n: int, tilt_deg: float, seed: int = 0, camera: Pose = OVERHEAD) -> list[Pose]:
    sight = Sight(T_base_camera=camera, intrinsics=INTRINSICS, width=512, height=424, nearest=0.5)
    found = candidate_poses(
        BOARD,
        HELD,
        sight,
        0.0,
        tilt_rad=np.radians(tilt_deg),
        rng=np.random.default_rng(seed),
        possible=lambda _: True,
    )
    return [next(found) for _ in range(n)]


def views_of(
    poses: list[Pose], sigma_px: float, seed: int = 1, camera: Pose = OVERHEAD, scale: float = 1.0
) -> list[View]:
    rng = np.random.default_rng(seed)
    views = []
    for pose in poses:
        points = (camera.inverse() @ pose @ HELD).apply(BOARD.corners() * scale)
        pixels = project(points, INTRINSICS) + rng.normal(0, sigma_px, (BOARD.n_corners, 2))
        corners = Corners(ids=np.arange(BOARD.n_corners), pixels=pixels)
        views.append(View(T_base_tcp=pose, corners=corners, intrinsics=INTRINSICS))
    return views


def errors(found: HandEye, camera: Pose = OVERHEAD) -> tuple[float, float]:
    """mm and degrees."""
    apart, turn = pose_distance(found.T_base_camera, camera)
    return apart * 1e3, float(np.degrees(turn))


def test_without_noise_the_camera_is_found_exactly():
    found = solve_hand_eye(BOARD, views_of(hand_poses(12, 30), 0.0))
    assert errors(found) == pytest.approx((0, 0), abs=1e-3)
    assert found.T_tcp_board.position == pytest.approx(HELD.position, abs=1e-6)
    assert found.scale == pytest.approx(1.0, abs=1e-6)
    assert found.rms_translation_m < 1e-6 and len(found.used) == 12


@settings(deadline=None, max_examples=8)
@given(
    x=st.floats(0.4, 0.6), y=st.floats(-0.1, 0.1), z=st.floats(0.9, 1.3),
    lean=st.tuples(st.floats(-15, 15), st.floats(-15, 15), st.floats(-180, 180)),
)  # fmt: skip
def test_wherever_the_camera_hangs_it_is_found(x, y, z, lean):
    turn = Rotation.from_euler("xyz", lean, degrees=True) * Rotation.from_euler("x", np.pi)
    camera = Pose(position=np.array([x, y, z]), quat_wxyz=turn.as_quat(scalar_first=True))
    found = solve_hand_eye(BOARD, views_of(hand_poses(8, 35, camera=camera), 0.0, camera=camera))
    assert errors(found, camera) == pytest.approx((0, 0), abs=1e-2)


@pytest.mark.slow
def test_a_tenth_of_a_pixel_of_noise_leaves_less_than_a_millimetre_and_a_tenth_of_a_degree():
    millimetres, degrees = zip(
        *(errors(solve_hand_eye(BOARD, views_of(hand_poses(24, 30, s), 0.1, s))) for s in range(4)),
        strict=True,
    )
    assert np.max(millimetres) < 1.0 and np.max(degrees) < 0.1


@pytest.mark.slow
def test_the_halves_of_the_pictures_say_how_large_the_error_is():
    """One draw of the noise may make the halves agree by chance; of several the median tells."""
    poses = hand_poses(24, 30)
    found = [solve_hand_eye(BOARD, views_of(poses, 0.2, seed)) for seed in range(5)]
    half = np.median([np.degrees(one.half_rotation_rad) for one in found])
    assert 0.01 < half < 1.0
    assert np.median([errors(one)[1] for one in found]) < 2 * half
    assert max(errors(one)[1] for one in found) < 3 * half


def test_a_view_that_contradicts_the_others_is_left_out():
    poses = hand_poses(14, 30)
    views = views_of(poses, 0.05)
    slipped = Pose(position=poses[3].position + np.array([0.02, 0, 0]), quat_wxyz=poses[3].quat_wxyz)
    views[3] = View(T_base_tcp=slipped, corners=views[3].corners, intrinsics=INTRINSICS)
    found = solve_hand_eye(BOARD, views)
    assert 3 not in found.used and len(found.used) == 13
    assert errors(found)[0] < 1.5


def test_pictures_with_few_corners_are_not_used():
    views = views_of(hand_poses(12, 30), 0.0)
    few = Corners(ids=np.arange(4), pixels=views[0].corners.pixels[:4])
    none = Corners(ids=np.empty(0, dtype=int), pixels=np.empty((0, 2)))
    views[0] = View(T_base_tcp=views[0].T_base_tcp, corners=few, intrinsics=INTRINSICS)
    views[1] = View(T_base_tcp=views[1].T_base_tcp, corners=none, intrinsics=INTRINSICS)
    assert solve_hand_eye(BOARD, views).used.tolist() == list(range(2, 12))


def refused(views: list[View]) -> str:
    with pytest.raises(BadCalibrationSet) as caught:
        solve_hand_eye(BOARD, views)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_too_few_pictures_are_refused():
    assert "7 of 7 pictures, at least 8" in refused(views_of(hand_poses(7, 30), 0.1))
    assert "0 of 0 pictures" in refused([])


def test_too_little_tilt_is_refused():
    assert "tilt the board in different directions" in refused(views_of(hand_poses(20, 8), 0.1))


def test_a_hand_that_only_turns_about_its_own_axis_is_refused():
    start = hand_poses(1, 5)[0]
    poses = [
        Pose(
            position=start.position,
            quat_wxyz=(
                Rotation.from_euler("z", angle, degrees=True)
                * Rotation.from_quat(start.quat_wxyz, scalar_first=True)
            ).as_quat(scalar_first=True),
        )
        for angle in np.linspace(-60, 60, 12)
    ]
    assert spread(poses)[1] < 1e-6
    assert "turned by 0.0 degrees" in refused(views_of(poses, 0.0))


def test_a_board_that_was_printed_smaller_is_refused_with_its_true_size():
    assert "seem to measure 38.8" in refused(views_of(hand_poses(24, 30), 0.05, scale=0.97))


def test_a_board_far_away_is_refused():
    far = Pose(position=np.array([0.5, 0.0, 2.2]), quat_wxyz=OVERHEAD.quat_wxyz)
    sight = Sight(
        T_base_camera=far, intrinsics=INTRINSICS * np.diag([3, 3, 1]), width=1536, height=1272, nearest=1.8
    )
    poses = candidate_poses(
        BOARD, HELD, sight, 0.0, tilt_rad=0.5, rng=np.random.default_rng(0), possible=lambda _: True
    )
    views = views_of([next(poses) for _ in range(10)], 0.0, camera=far)
    assert "pixels wide in the image, at least 9" in refused(views)


@pytest.mark.parametrize(
    ("n_flat", "tilt_deg", "n_tilted", "seed", "message"),
    [
        (12, 4, 5, 0, r"second axis in the 12 pictures that agree \(5 contradict them\), at least 8 are"),
        (12, 2, 6, 1, r"does not repeat: two halves of the pictures place the board 3\d\.\d mm apart"),
    ],
    ids=["all tilted pictures rejected", "one left"],
)
def test_a_board_that_slips_as_it_is_tilted_is_refused(
    n_flat: int, tilt_deg: float, n_tilted: int, seed: int, message: str
):
    """What is left once the tilted pictures are rejected does not determine the camera."""
    poses = hand_poses(n_flat, tilt_deg, seed) + hand_poses(n_tilted, 45, seed + 50)
    views = views_of(poses, 0.1, seed)
    for i in range(n_flat, len(views)):
        slipped = Pose(position=poses[i].position + [0.02, 0.01, 0], quat_wxyz=poses[i].quat_wxyz)
        views[i] = View(T_base_tcp=slipped, corners=views[i].corners, intrinsics=INTRINSICS)
    text = refused(views)
    assert re.search(message, text) and "take the pictures again" in text


def test_a_board_that_slips_in_the_hand_is_refused():
    poses = hand_poses(20, 30)
    views = views_of(poses, 0.05)
    rng = np.random.default_rng(5)
    loose = [
        View(
            T_base_tcp=Pose(position=p.position + rng.normal(0, 0.01, 3), quat_wxyz=p.quat_wxyz),
            corners=v.corners,
            intrinsics=INTRINSICS,
        )
        for p, v in zip(poses, views, strict=True)
    ]
    assert "contradict each other" in refused(loose)
