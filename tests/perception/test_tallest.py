"""The tallest thing in images of boxes whose heights are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hal import RgbdFrame
from hal.sensor_noise import SensorNoise, add_noise
from mskgrasp.perception.part_detection import view_part
from mskgrasp.perception.tallest import tallest_thing
from tests import synthetic
from tests.synthetic import REGION, Box

PART = Box(x=0.45, y=0.02, yaw=0.4, size=(0.07, 0.02, 0.03))
FILLED = Box(x=0.6, y=-0.1, yaw=0.0, size=(0.04, 0.04, 0.12))
LOWER, UPPER = np.array([0.25, -0.4, 0.0]), np.array([0.75, 0.4, 0.75])


def height(frame: RgbdFrame, **settings) -> float:
    return tallest_thing(frame, table_z=0.0, lower=LOWER, upper=UPPER, **settings)


def test_the_tallest_of_two_boxes_counts_and_an_empty_table_is_flat():
    assert height(synthetic.frame([PART, FILLED])) == pytest.approx(0.12, abs=1e-3)
    assert height(synthetic.frame([PART])) == pytest.approx(0.03, abs=1e-3)
    assert height(synthetic.frame([])) == pytest.approx(0.0, abs=1e-3)


def test_the_part_itself_does_not_count_where_others_are_asked_for():
    frame = synthetic.frame([dataclasses.replace(PART, size=(0.07, 0.02, 0.2))])
    view = view_part(
        frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=REGION, alone=True
    )
    assert height(frame) == pytest.approx(0.2, abs=1e-3)
    assert height(frame, beside=view) == pytest.approx(0.0, abs=1e-3)


def test_what_is_seen_beside_the_space_of_the_hand_does_not_count():
    frame = synthetic.frame([FILLED])
    narrow = tallest_thing(frame, table_z=0.0, lower=LOWER, upper=np.array([0.5, 0.4]))
    assert narrow == pytest.approx(0.0, abs=1e-3)


def test_a_flying_pixel_is_no_thing_and_noise_raises_little():
    frame = synthetic.frame([PART])
    depth = frame.depth.copy()
    depth[10, 10] -= 0.3
    depth[20, 20] = np.nan
    assert height(dataclasses.replace(frame, depth=depth)) == pytest.approx(0.03, abs=1e-3)
    noisy = add_noise(frame.depth, frame.intrinsics, SensorNoise(model="iid"), np.random.default_rng(0))
    assert 0.025 < height(dataclasses.replace(frame, depth=noisy)) < 0.045
