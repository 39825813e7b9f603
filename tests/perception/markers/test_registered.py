from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.perception.markers.registered import RegisteredFrame
from tests.perception.markers.drawn import BEFORE, HEIGHT, SCALE, draw
from tests.synthetic import INTRINSICS, OVERHEAD, TABLE_Z

TOP = np.array([0.45, 0.02, HEIGHT])


@pytest.fixture(scope="module")
def frame() -> RegisteredFrame:
    return RegisteredFrame(draw(BEFORE), TABLE_Z)


def test_a_point_of_the_base_is_projected_as_by_a_pinhole(frame: RegisteredFrame):
    x, y, z = OVERHEAD.inverse().apply(TOP)
    depth_pixel = np.array(
        [INTRINSICS[0, 0] * x / z + INTRINSICS[0, 2], INTRINSICS[1, 1] * y / z + INTRINSICS[1, 2]]
    )
    assert frame.scale == SCALE and frame.focal == pytest.approx(SCALE * 365.5)
    assert frame.depth_pixel(frame.colour_pixel(TOP)) == pytest.approx(depth_pixel)


def test_a_pixel_and_its_depth_give_the_point_again(frame: RegisteredFrame):
    pixel = frame.colour_pixel(TOP)
    depth = frame.depth_at_height(pixel, HEIGHT)
    assert depth == pytest.approx(0.8 - HEIGHT)  # the camera looks straight down from 0.8 m
    assert frame.point_base(pixel, depth) == pytest.approx(TOP)


def test_depths_are_those_near_the_middle_of_a_spot_without_invalid_ones():
    shown = draw(BEFORE)
    depth = shown.depth.copy()
    depth[80, 80] = np.nan
    frame = RegisteredFrame(replace(shown, depth=depth), TABLE_Z)
    middle = (np.array([80.0, 80.0]) + 0.5) * SCALE - 0.5
    grid = np.stack(np.meshgrid(*[np.arange(78 * SCALE, 83 * SCALE)] * 2), axis=-1).reshape(-1, 2)
    assert len(frame.depths_within(grid, middle, 1.5 * SCALE)) == 8  # 3 x 3 pixels of depth but one
    assert len(frame.depths_within(grid + 40 * SCALE, middle, SCALE)) == 0


def test_colour_of_another_size_is_refused():
    shown = draw(BEFORE)
    assert shown.fine_colour is not None
    with pytest.raises(MarkersNotFound, match="not registered"):
        RegisteredFrame(replace(shown, fine_colour=shown.fine_colour[:-1]), TABLE_Z)
