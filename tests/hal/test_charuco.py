"""The calibration board: its geometry by hand, its pictures from poses that are known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from hal.charuco import (
    MIN_CORNERS,
    Board,
    Corners,
    board_pose,
    detect,
    draw,
    infrared_grey,
    project,
    square_px,
)
from mskgrasp.core.geometry import Pose, pose_distance
from tests.hal.board_picture import INTRINSICS, board_picture

BOARD = Board()


def random_pose(rng: np.random.Generator, distance: float = 0.7) -> Pose:
    """A board near the optical axis, tilted by up to 45 degrees and turned at will."""
    tilt = np.radians(45) * rng.uniform(0.2, 1)
    towards = rng.uniform(0, 2 * np.pi)
    lean = Rotation.from_rotvec(tilt * np.array([np.cos(towards), np.sin(towards), 0]))
    turn = lean * Rotation.from_euler("z", rng.uniform(-np.pi, np.pi))
    position = np.array([*rng.uniform(-0.08, 0.08, 2), distance + rng.uniform(-0.1, 0.1)])
    return Pose(position=position, quat_wxyz=turn.as_quat(scalar_first=True))


def seen_exactly(pose: Pose, ids: np.ndarray) -> Corners:
    return Corners(ids=ids, pixels=project(pose.apply(BOARD.corners()[ids]), INTRINSICS))


def test_corners_are_numbered_along_rows_from_the_top_left():
    """5 x 4 squares of 4 cm: 4 x 3 inner corners, the first 6 cm left of the middle and 4 cm above."""
    corners = BOARD.corners()
    assert corners.shape == (BOARD.n_corners, 3) == (12, 3)
    expected = [[-0.06, -0.04, 0], [-0.02, -0.04, 0], [-0.06, 0, 0], [0.06, 0.04, 0]]
    assert corners[[0, 1, 4, 11]] == pytest.approx(np.array(expected), abs=1e-7)
    assert BOARD.size == pytest.approx((0.2, 0.16))
    assert BOARD.outline(0.01)[[0, 2]] == pytest.approx(np.array([[-0.11, -0.09, 0], [0.11, 0.09, 0]]))


def test_the_drawn_pattern_has_its_corners_where_they_are_numbered():
    """40 pixels a square and a white edge of 10: an edge between two pixels is at a half."""
    image = BOARD.image(40, margin=0.01)
    assert image.shape == (4 * 40 + 20, 5 * 40 + 20)
    assert (image[:10] == 255).all() and (image[:, -10:] == 255).all()
    found = detect(BOARD, image)
    assert sorted(found.ids.tolist()) == list(range(12))
    expected = 40 / 0.04 * (BOARD.corners()[found.ids, :2] + [0.1, 0.08]) + 10 - 0.5
    assert found.pixels == pytest.approx(expected, abs=0.1)


def test_the_board_is_found_in_infrared_that_is_dark_fades_and_has_a_glint():
    """Linear in the light: print reflects a tenth, the border of the image is five times darker."""
    pose = random_pose(np.random.default_rng(0))
    picture = board_picture(BOARD, pose)[..., 0]
    rows, columns = np.mgrid[0 : picture.shape[0], 0 : picture.shape[1]]
    fades = 1 / (1 + 4 * ((columns - 256) ** 2 + (rows - 212) ** 2) / 332**2)
    infrared = (900 * (0.1 + 0.9 * picture / 255) * fades).astype(np.uint16)
    infrared[5:15, 5:15] = 65535
    grey = infrared_grey(infrared)
    assert grey.dtype == np.uint8 and grey.max() == 255
    found = detect(BOARD, grey)
    assert len(found.ids) >= 10
    off = found.pixels - seen_exactly(pose, found.ids).pixels
    assert np.sqrt((off**2).mean()) < 0.15
    assert infrared_grey(np.zeros((4, 5), np.uint16)).max() == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_picture_gives_back_the_pose_of_the_board(seed: int):
    pose = random_pose(np.random.default_rng(seed))
    found = detect(BOARD, board_picture(BOARD, pose))
    assert len(found.ids) >= 10
    off = found.pixels - seen_exactly(pose, found.ids).pixels
    assert np.sqrt((off**2).mean()) < 0.15
    measured = board_pose(BOARD, found, INTRINSICS)
    assert measured is not None
    distance, angle = pose_distance(measured, pose)
    # A fifth of a pixel is 0.4 mm across at 0.7 m, and several times that along the line of sight.
    assert distance < 3e-3 and np.degrees(angle) < 1.5


def test_exact_corners_give_the_exact_pose_whichever_of_them_are_seen():
    rng = np.random.default_rng(0)
    for _ in range(30):
        pose = random_pose(rng)
        ids = rng.permutation(12)[: rng.integers(8, 13)]
        measured = board_pose(BOARD, seen_exactly(pose, ids), INTRINSICS)
        assert measured is not None
        distance, angle = pose_distance(measured, pose)
        assert distance < 1e-5 and angle < 1e-4


@pytest.mark.parametrize("ids", [range(MIN_CORNERS - 1), ()])
def test_too_few_corners_give_no_pose(ids: range):
    pose = random_pose(np.random.default_rng(0))
    assert board_pose(BOARD, seen_exactly(pose, np.array(ids, dtype=int)), INTRINSICS) is None


def test_corners_on_a_line_give_no_pose():
    wide = Board(columns=8, rows=3)
    ids = np.arange(7)
    pixels = project(
        Pose(position=np.array([0, 0, 0.8]), quat_wxyz=np.array([1.0, 0, 0, 0])).apply(wide.corners()[ids]),
        INTRINSICS,
    )
    assert board_pose(wide, Corners(ids=ids, pixels=pixels), INTRINSICS) is None


def test_an_image_without_a_board_has_no_corners():
    found = detect(BOARD, np.full((120, 160, 3), 128, np.uint8))
    assert found.ids.shape == (0,) and found.pixels.shape == (0, 2)


def test_points_are_projected_as_opencv_does():
    points = np.random.default_rng(0).uniform([-0.3, -0.3, 0.5], [0.3, 0.3, 1.5], (20, 3))
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), INTRINSICS, None)[0][:, 0]
    assert project(points, INTRINSICS) == pytest.approx(expected, abs=1e-9)
    assert project(points.reshape(4, 5, 3), INTRINSICS).shape == (4, 5, 2)


def test_the_width_of_a_square_is_that_of_neighbours_alone():
    """Face to face at 0.8 m a square of 4 cm is 365.456 * 0.04 / 0.8 pixels wide."""
    pose = Pose(position=np.array([0, 0, 0.8]), quat_wxyz=np.array([1.0, 0, 0, 0]))
    every = seen_exactly(pose, np.arange(12))
    assert square_px(every, BOARD) == pytest.approx(18.2728)
    # 3 ends the first row, 4 begins the second: beside each other in number only.
    assert square_px(seen_exactly(pose, np.array([3, 4])), BOARD) == 0
    assert square_px(seen_exactly(pose, np.array([3, 7])), BOARD) == pytest.approx(18.2728)


def test_drawn_corners_are_green_where_found_and_red_where_expected():
    dark = np.zeros((20, 30, 3), np.uint8)
    corners = Corners(ids=np.array([0]), pixels=np.array([[8.0, 10.0]]))
    picture = draw(dark, corners, np.array([[22.0, 10.0]]), zoom=4)
    assert picture.shape == (80, 120, 3)
    green, red = (np.argwhere(picture[..., channel] > 150).mean(axis=0) for channel in (1, 0))
    # The middle of a pixel of 4 x 4 is at 4 k + 1.5, drawn at a whole pixel.
    assert green == pytest.approx([41.5, 33.5], abs=0.6) and red == pytest.approx([41.5, 89.5], abs=0.6)
    assert not dark.any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (dict(marker=0.037), r"marker 0.037 m must be 0.4 to 0.9 times the square .*0.0160 .. 0.0360"),
        (dict(marker=0.015), "marker 0.015 m must be"),
        (dict(columns=12, rows=9), r"12 x 9 squares needs more than the 50 markers"),
        (dict(columns=2), "greater than or equal to 3"),
        (dict(columns=3, rows=3), "3 x 3 squares has 4 corners, 6 are needed; legal: 3 x 4"),
    ],
)
def test_a_board_that_cannot_be_is_refused(settings: dict, message: str):
    with pytest.raises(ValidationError, match=message):
        Board(**settings)
