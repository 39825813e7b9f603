"""libfreenect2's images turned into ours, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from hal.kinect2.images import HEIGHT, WIDTH, metric_depth, rgb_colour, unmirrored_intrinsics


def test_depth_is_metres_from_left_to_right_and_an_offset_is_added_to_what_is_valid():
    raw = np.array([[800.0, 0.0, -3.0, np.nan], [np.inf, -np.inf, 1234.5, 1.0]], np.float32)
    nan = np.nan
    expected = np.array([[nan, nan, nan, 0.776], [-0.023, 1.2105, nan, nan]], np.float32)
    depth = metric_depth(raw, -0.024)
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth, expected, atol=1e-6)


def test_neither_image_shares_memory_with_the_drivers():
    raw, colour = np.full((3, 4), 500, np.float32), np.full((3, 4, 4), 7, np.uint8)
    depth, rgb = metric_depth(raw, 0.0), rgb_colour(colour)
    raw[:], colour[:] = 0, 0
    assert (depth == 0.5).all() and (rgb == 7).all()
    assert rgb.flags.c_contiguous


def test_colour_is_red_green_blue_from_left_to_right():
    bgrx = np.array([[[1, 2, 3, 99], [4, 5, 6, 99]]], np.uint8)
    assert rgb_colour(bgrx).tolist() == [[[6, 5, 4], [3, 2, 1]]]


def test_a_point_is_seen_at_its_mirrored_column():
    """libfreenect2 shows what is to the right of the axis to the left of cx."""
    fx, fy, cx, cy = 365.456, 366.0, 254.878, 205.395
    matrix = unmirrored_intrinsics(fx, fy, cx, cy)
    rng = np.random.default_rng(0)
    for x, y, z in rng.uniform([-0.3, -0.3, 0.5], [0.3, 0.3, 1.5], (20, 3)):
        mirrored = -x / z * fx + cx, y / z * fy + cy
        u, v, w = matrix @ [x, y, z]
        assert (u / w, v / w) == pytest.approx((WIDTH - 1 - mirrored[0], mirrored[1]))
    image = np.zeros((HEIGHT, WIDTH), np.float32)
    image[17, 100] = 900
    assert np.argwhere(np.isfinite(metric_depth(image, 0.0))).tolist() == [[17, 411]]
