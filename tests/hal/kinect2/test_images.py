"""libfreenect2's images turned into ours, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from hal.kinect2.images import (
    HEIGHT,
    WIDTH,
    Undistortion,
    median_of_valid,
    metric_depth,
    unmirrored_intrinsics,
)

LENS = dict(
    fx=365.456, fy=365.456, cx=254.878, cy=205.395, k1=0.0905474, k2=-0.26819, k3=0.0950862, p1=0.0, p2=0.0
)  # fmt: skip


def test_depth_is_metres_and_an_offset_is_added_to_what_is_valid():
    raw = np.array([[800.0, 0.0, -3.0, np.nan], [np.inf, -np.inf, 1234.5, 1.0]], np.float32)
    nan = np.nan
    expected = np.array([[0.776, nan, nan, nan], [nan, nan, 1.2105, -0.023]], np.float32)
    depth = metric_depth(raw, -0.024)
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth, expected, atol=1e-6)


def test_the_median_is_that_of_the_images_which_measured_a_pixel_if_half_of_them_did():
    nan, inf = np.nan, np.inf
    images = [
        np.array([[1.0, 4.0, 0.0, nan, 7.0]], np.float32),
        np.array([[3.0, nan, 2.0, -1.0, 0.0]], np.float32),
        np.array([[2.0, 6.0, inf, 0.0, nan]], np.float32),
        np.array([[9.0, 5.0, 4.0, 5.0, nan]], np.float32),
    ]
    assert median_of_valid(images).tolist() == [[2.5, 5.0, 3.0, 0.0, 0.0]]
    assert median_of_valid(images[:3]).tolist() == [[2.0, 5.0, 0.0, 0.0, 0.0]]
    assert median_of_valid(images[:1]).tolist() == [[1.0, 4.0, 0.0, 0.0, 7.0]]
    assert images[0][0, 3] != images[0][0, 3], "the exposures themselves are left alone"


def test_pixels_are_undistorted_as_libfreenect2_does_and_mirrored_back():
    """Read from the real Registration.undistortDepth (pylibfreenect2 0.1.4), same camera."""
    numbers = np.arange(WIDTH * HEIGHT, dtype=np.float32).reshape(HEIGHT, WIDTH)
    nearest = Undistortion(LENS).nearest(numbers)
    measured = [
        (200, 139, 102538), (217, 423, 111528), (320, 131, 164482), (402, 209, 206545), (14, 329, 6985),
        (61, 281, 31001), (348, 43, 177709), (402, 14, 201751), (105, 443, 54204), (132, 385, 67458),
    ]  # fmt: skip
    assert [int(nearest[row, WIDTH - 1 - column]) for row, column, _ in measured] == [n for *_, n in measured]


def test_infrared_is_interpolated_where_depth_takes_the_nearest_pixel():
    columns = np.tile(np.arange(WIDTH, dtype=np.float32), (HEIGHT, 1))
    undistortion = Undistortion(LENS)
    smooth, nearest = undistortion.interpolated(columns), undistortion.nearest(columns)
    assert np.abs(smooth - nearest)[20:-20, 20:-20].max() <= 0.5 + 1e-3
    steps = -np.diff(smooth, axis=1)[20:-20, 20:-20]
    assert steps.min() > 0.8 and steps.max() < 1.2  # OpenCV interpolates in 32 steps
    middle = WIDTH - 1 - LENS["cx"]
    assert smooth[205, round(middle)] == pytest.approx(LENS["cx"] + middle - round(middle), abs=0.04)


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
    straight = Undistortion(LENS | dict(k1=0.0, k2=0.0, k3=0.0))
    assert np.argwhere(straight.nearest(image)).tolist() == [[17, 411]]
