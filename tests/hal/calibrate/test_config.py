"""Pose of the board in the hand from the operator's settings."""

from __future__ import annotations

import numpy as np
import pytest

from hal.calibrate.config import CalibrateConfig
from hal.calibrate.hand_eye import MIN_SPREAD_RAD, MIN_VIEWS, spread
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from tests.hal.calibrate.test_hand_eye import hand_poses


@pytest.mark.parametrize(
    ("turn", "point", "in_hand"),
    [
        (0.0, [0.05, 0.02, 0.0], [0.21, 0.02, 0.01]),
        (90.0, [0.05, 0.0, 0.0], [0.16, 0.05, 0.01]),  # x as printed is the hand's y
        (180.0, [0.05, 0.02, 0.0], [0.11, -0.02, 0.01]),
        (-90.0, [0.0, 0.05, 0.0], [0.21, 0.0, 0.01]),
    ],
)
def test_a_point_of_the_board_is_where_turn_and_place_put_it(
    turn: float, point: list[float], in_hand: list[float]
):
    config = CalibrateConfig(board_at=(0.16, 0.0, 0.01), board_turn_deg=turn)
    assert config.T_tcp_board().apply(np.array(point)) == pytest.approx(in_hand, abs=1e-12)


@pytest.mark.parametrize(
    ("towards", "turn", "right", "down", "forward"),
    [
        (None, 0.0, [0, -1, 0], [-1, 0, 0], [0, 0, -1]),  # the image's top away from the base
        (None, 180.0, [0, 1, 0], [1, 0, 0], [0, 0, -1]),
        (None, 90.0, [-1, 0, 0], [0, 1, 0], [0, 0, -1]),  # its top to the right of before
        ((0.5, 0.5, 0.5), 0.0, [0, -0.7071, -0.7071], [-1, 0, 0], [0, 0.7071, -0.7071]),
        ((0.0, 0.0, 0.5), 0.0, [0, -1, 0], [-0.7071, 0, 0.7071], [-0.7071, 0, -0.7071]),
    ],
)
def test_a_camera_measured_by_hand_looks_where_it_is_pointed(
    towards, turn: float, right: list[float], down: list[float], forward: list[float]
):
    config = CalibrateConfig(camera_at=(0.5, 0.0, 1.0), camera_towards=towards, camera_turn_deg=turn)
    pose = config.T_base_camera()
    assert pose.position.tolist() == [0.5, 0.0, 1.0]
    assert pose.as_matrix()[:3, :3] == pytest.approx(np.stack([right, down, forward], axis=1), abs=1e-3)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"poses": 7}, "'poses': input should be greater than or equal to 8"),
        ({"tilt_deg": 24}, "'tilt_deg': input should be greater than or equal to 25"),
        ({"tilt_deg": 60}, "'tilt_deg': input should be less than or equal to 50"),
        ({"board_turn_deg": 181}, "'board_turn_deg'"),
        ({"camera_towards": (0.5, 0, 0)}, "give camera_at, too"),
        ({"camera_turn_deg": 90.0}, "give camera_at, too"),
        (
            {"camera_at": (0.5, 0, 1), "camera_towards": (2, 0, 1)},
            "camera_towards [2.0, 0.0, 1.0] is 0 degrees below the horizon of a camera at [0.5, 0.0, 1.0], "
            "at least 30 are needed",
        ),
        ({"camera_at": (0.5, 0, 1), "camera_towards": (0.5, 0, 1)}, "is 0 degrees below the horizon"),
        ({"camera_at": (0.5, 0, 1), "camera_towards": (0.5, 0, 2)}, "is -90 degrees below the horizon"),
        ({"speed": 0}, "'speed': input should be greater than 0"),
        ({"board": {"square": 0.04, "marker": 0.05}}, "marker 0.05 m must be 0.4 to 0.9 times the square"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict, message: str):
    with pytest.raises(BadConfig) as caught:
        check_config(CalibrateConfig, values, "calibration")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_the_least_tilt_determines_the_camera_with_the_fewest_pictures():
    config = check_config(CalibrateConfig, {"tilt_deg": 25, "poses": MIN_VIEWS}, "calibration")
    for seed in range(40):
        assert spread(hand_poses(config.poses, config.tilt_deg, seed))[1] > MIN_SPREAD_RAD, seed
