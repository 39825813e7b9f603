"""Poses that show the board to the camera, checked with OpenCV's projection."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hal.calibrate.board_poses import TABLE_MARGIN, Sight, candidate_poses, in_sight, way_is_clear
from hal.calibrate.config import CalibrateConfig
from hal.charuco import Board
from mskgrasp.core.geometry import Pose
from tests.hal.board_picture import INTRINSICS

BOARD = Board()
HELD = Pose(
    position=np.array([0.165, 0.004, -0.012]),
    quat_wxyz=Rotation.from_euler("xyz", [2, -3, 5], degrees=True).as_quat(scalar_first=True),
)
DOWN = np.array([0.0, 1.0, 0.0, 0.0])
CAMERA = Pose(
    position=np.array([0.5, 0.0, 1.2]),
    quat_wxyz=Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]).as_quat(scalar_first=True),
)
SIGHT = Sight(T_base_camera=CAMERA, intrinsics=INTRINSICS, width=512, height=424, nearest=0.5)
TABLE_Z, TILT = 0.1, np.radians(30)


def poses(n: int, seed: int = 0, **changes: object) -> list[Pose]:
    settings = (
        dict(tilt_rad=TILT, rng=np.random.default_rng(seed), possible=lambda _: True, sight=SIGHT) | changes
    )
    sight = settings.pop("sight")
    return list(itertools.islice(candidate_poses(BOARD, HELD, sight, TABLE_Z, **settings), n))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found() -> list[Pose]:
    return poses(60)


def test_every_inner_corner_is_in_the_image_and_wide_enough(found: list[Pose]):
    rotation, shift = cv2.Rodrigues(CAMERA.inverse().as_matrix()[:3, :3])[0], CAMERA.inverse().position
    for pose in found:
        corners = (pose @ HELD).apply(BOARD.corners())
        pixels = cv2.projectPoints(corners, rotation, shift, INTRINSICS, None)[0][:, 0]
        assert (pixels > 5).all() and (pixels < [506, 418]).all()
        across = np.linalg.norm(np.diff(pixels.reshape(3, 4, 2), axis=1), axis=-1)
        # 14 pixels a square face to face at the farthest, less by the tilt and the depth of the board.
        assert across.min() > 14 * np.cos(TILT + np.radians(35)) * 0.9


def test_the_printed_side_faces_the_camera_tilted_no_more_than_asked(found: list[Pose]):
    leans = []
    for pose in found:
        board = pose @ HELD
        normal = board.as_matrix()[:3, 2]
        assert normal @ (board.position - CAMERA.position) > 0
        leans.append(np.degrees(np.arccos(np.clip(-normal[2], -1, 1))))
    assert max(leans) <= 30 + 1e-6 and min(leans) >= 9 - 1e-6
    assert np.ptp(leans) > 15  # not all by the same angle


@pytest.mark.parametrize("towards", [(0.5, 0.0, 0.1), (0.1, 0.0, 0.1), (0.9, 0.3, 0.1)])
def test_a_camera_that_looks_sideways_sees_the_board_face_to_face_too(towards: tuple[float, float, float]):
    """Up to 24 degrees off the vertical; a board that faced the ceiling would be tilted by as much more."""
    config = CalibrateConfig(camera_at=(0.5, 0.0, 1.2), camera_towards=towards)
    camera = config.T_base_camera()
    sight = Sight(T_base_camera=camera, intrinsics=INTRINSICS, width=512, height=424, nearest=0.5)
    found = poses(40, sight=sight)
    assert len(found) == 40
    axis = camera.as_matrix()[:3, 2]
    leans = [np.degrees(np.arccos((pose @ HELD).as_matrix()[:3, 2] @ axis)) for pose in found]
    assert max(leans) <= 30 + 1e-6 and min(leans) >= 9 - 1e-6
    depths = [camera.inverse().apply((pose @ HELD).position)[2] for pose in found]
    assert np.ptp(depths) > 0.3  # from the nearest to the table, whichever way that is
    for pose in found:
        assert (pose @ HELD).apply(BOARD.outline(0.01))[:, 2].min() >= TABLE_Z + TABLE_MARGIN


def test_the_tilts_go_round(found: list[Pose]):
    """The first dozen leans to all four sides: a calibration of few pictures depends on it."""
    normals = np.array([(pose @ HELD).as_matrix()[:3, 2] for pose in found[:12]])
    quadrants = {(x > 0, y > 0) for x, y, _ in normals}
    assert len(quadrants) == 4


def test_the_board_stays_off_the_table_and_away_from_the_camera(found: list[Pose]):
    for pose in found:
        outline = (pose @ HELD).apply(BOARD.outline(0.01))
        assert outline[:, 2].min() >= TABLE_Z + TABLE_MARGIN
        depth = CAMERA.inverse().apply((pose @ HELD).apply(BOARD.outline(-0.6 * BOARD.square)))[:, 2]
        assert depth.min() >= 0.8 * SIGHT.nearest - 1e-9


def test_poses_follow_from_the_seed_and_pass_what_the_arm_refuses():
    first, again, other = poses(5), poses(5), poses(5, seed=1)
    assert all(np.array_equal(a.as_vector(), b.as_vector()) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].as_vector(), other[0].as_vector())
    left = poses(5, possible=lambda pose: pose.position[1] > 0)
    assert len(left) == 5 and all(pose.position[1] > 0 for pose in left)


def test_a_camera_that_cannot_see_the_board_ends_the_search():
    """Under the table's margin nothing fits between the table and a camera 4 cm over it."""
    low = Sight(
        T_base_camera=Pose(position=np.array([0.5, 0.0, TABLE_Z + 0.06]), quat_wxyz=CAMERA.quat_wxyz),
        intrinsics=INTRINSICS, width=512, height=424, nearest=0.5,
    )  # fmt: skip
    assert poses(1, sight=low) == []


@pytest.mark.parametrize(
    ("x", "z", "turn", "seen"),
    [
        (0.5, 0.5, 180, True),
        (0.5, 0.5, 0, False),  # its back
        (0.5, 0.85, 180, False),  # nearer than 0.8 * 0.5 m
        (0.9, 0.5, 180, False),  # out of the image: 512 pixels see 0.49 m to a side at 0.7 m
        (0.5, 1.5, 180, False),  # behind the camera
    ],
)
def test_what_the_camera_sees(x: float, z: float, turn: float, seen: bool):
    facing = Rotation.from_euler("x", turn, degrees=True).as_quat(scalar_first=True)
    board = Pose(position=np.array([x, 0.0, z]), quat_wxyz=facing)
    assert in_sight(BOARD.outline(), board, SIGHT) is seen


def test_a_way_that_dips_the_board_to_the_table_is_not_clear():
    """The board is held edge down, 8 cm from its middle to the edge; between two tilts it sinks."""
    straight = Pose(position=np.zeros(3), quat_wxyz=np.array([1.0, 0, 0, 0]))

    def at(z: float, roll: float) -> Pose:
        turn = Rotation.from_euler("x", 180 + roll, degrees=True).as_quat(scalar_first=True)
        return Pose(position=np.array([0.5, 0.0, z]), quat_wxyz=turn)

    margin = TABLE_Z + TABLE_MARGIN / 2
    assert way_is_clear([at(margin + 0.001, 0), at(margin + 0.1, 0)], straight, BOARD, TABLE_Z)
    assert not way_is_clear([at(margin - 0.001, 0), at(margin + 0.1, 0)], straight, BOARD, TABLE_Z)
    # From 60 degrees to 120: at both ends the lower edge is 80 mm * sin 60 down, upright 80 mm.
    for z, clear in ((0.081, True), (0.075, False)):
        assert way_is_clear([at(margin + z, 60), at(margin + z, 120)], straight, BOARD, TABLE_Z) is clear
