"""Colour registered to depth, against libfreenect2's own arithmetic and by known points."""

from __future__ import annotations

from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hal.kinect2.images import HEIGHT, WIDTH
from hal.kinect2.registration import COLOUR_HEIGHT, COLOUR_WIDTH, Registration


@pytest.fixture
def optics(fake: ModuleType) -> tuple[dict[str, float], dict[str, float]]:
    return fake.scene.INFRARED, fake.scene.COLOUR


def test_a_depth_pixel_has_the_colour_that_libfreenect2_gives_it(
    fake: ModuleType, optics: tuple[dict[str, float], dict[str, float]]
):
    lens, colour = optics
    depth = np.full((HEIGHT, WIDTH), 0.8, np.float32)
    depth[150:260, 200:330] = 0.7
    columns, rows = Registration(lens, colour, 1).colour_pixels(depth)
    index = fake.scene.colour_pixels(SimpleNamespace(**lens), SimpleNamespace(**colour), depth[:, ::-1] * 1e3)
    index = index[:, ::-1]
    assert (index >= 0).mean() > 0.7
    seen = (index >= 0) & (rows > 0) & (rows < COLOUR_HEIGHT - 1)
    assert np.abs(columns[seen] - index[seen] % COLOUR_WIDTH).max() < 0.51  # libfreenect2 rounds
    assert np.abs(rows[seen] - index[seen] // COLOUR_WIDTH).max() < 0.51


@pytest.mark.parametrize("scale", [1, 2, 3])
def test_a_point_is_found_at_its_pixel_of_the_finer_image(
    fake: ModuleType, optics: tuple[dict[str, float], dict[str, float]], scale: int
):
    lens, colour = optics
    registration = Registration(lens, colour, scale)
    rng = np.random.default_rng(0)
    for x, y, z in rng.uniform([-0.3, -0.2, 0.6], [0.3, 0.2, 1.4], (10, 3)):
        image = np.zeros((COLOUR_HEIGHT, COLOUR_WIDTH, 4), np.float32)
        column, row = fake.scene.to_colour(np.array(x / z), np.array(y / z), np.array(1 / z))
        rows, columns = np.mgrid[0:COLOUR_HEIGHT, 0:COLOUR_WIDTH]
        image[..., 1] = 255 * np.exp(-((columns - column) ** 2 + (rows - row) ** 2) / (2 * 4.0**2))
        found = registration.apply(image.astype(np.uint8), np.full((HEIGHT, WIDTH), z, np.float32))
        green = found[..., 1].astype(float)
        assert found.shape == (scale * HEIGHT, scale * WIDTH, 3)
        centre = np.array([(green * axis).sum() for axis in np.mgrid[: green.shape[0], : green.shape[1]]])
        v, u = (centre / green.sum() + 0.5) / scale - 0.5
        assert u == pytest.approx(x / z * lens["fx"] + WIDTH - 1 - lens["cx"], abs=0.05)
        assert v == pytest.approx(y / z * lens["fy"] + lens["cy"], abs=0.05)


def test_depth_that_is_24_mm_too_far_displaces_colour_by_a_millimetre_and_a_half(
    optics: tuple[dict[str, float], dict[str, float]],
):
    registration = Registration(*optics, 1)
    right, wrong = (
        registration.colour_pixels(np.full((HEIGHT, WIDTH), z, np.float32))[0] for z in (0.8, 0.824)
    )
    pixel = -np.diff(right[212])[256]  # colour pixels for one of depth
    assert (right - wrong)[212, 256] / pixel * 0.8 / optics[0]["fx"] == pytest.approx(1.5e-3, abs=0.1e-3)


def test_what_the_colour_camera_does_not_see_beside_a_part_is_black_and_the_part_is_not(
    optics: tuple[dict[str, float], dict[str, float]],
):
    """A part 0.1 m high; its shadow for the colour camera is 52 mm * 0.1 / 0.7 wide."""
    depth = np.full((HEIGHT, WIDTH), 0.8, np.float32)
    part = np.s_[150:260, 200:330]
    depth[part] = 0.7
    image = np.full((COLOUR_HEIGHT, COLOUR_WIDTH, 4), 200, np.uint8)
    found = Registration(*optics, 1).apply(image, depth)[..., 0]
    assert (found[part] == 0).sum() <= 4  # at most its corners, which the median of depth rounds
    beside = {"left": (found[205, 150:200] == 0).sum(), "right": (found[205, 330:380] == 0).sum()}
    shadow_px = 0.052 * 0.1 / 0.7 / 0.8 * optics[0]["fx"]
    assert max(beside.values()) == pytest.approx(shadow_px, abs=1.5) and min(beside.values()) <= 1


def test_a_hole_of_depth_takes_the_colour_of_its_surroundings(
    optics: tuple[dict[str, float], dict[str, float]],
):
    depth = np.full((HEIGHT, WIDTH), 0.8, np.float32)
    image = np.random.default_rng(0).integers(0, 255, (COLOUR_HEIGHT, COLOUR_WIDTH, 4)).astype(np.uint8)
    whole = Registration(*optics, 3).apply(image, depth)
    depth[200:220, 250:270] = np.nan
    assert np.array_equal(Registration(*optics, 3).apply(image, depth), whole)


def test_colour_is_red_green_blue_and_shares_nothing_with_the_drivers_memory(
    optics: tuple[dict[str, float], dict[str, float]],
):
    image = np.tile(np.array([1, 2, 3, 99], np.uint8), (COLOUR_HEIGHT, COLOUR_WIDTH, 1))
    found = Registration(*optics, 1).apply(image, np.full((HEIGHT, WIDTH), 0.8, np.float32))
    image[:] = 0
    assert found[212, 256].tolist() == [3, 2, 1] and found.flags.c_contiguous and found.dtype == np.uint8
