from __future__ import annotations

import cv2
import numpy as np
import pytest

from mskgrasp.perception.markers.spots import find_spots

FINE = 16


def _grey(*squares: tuple[float, float, float, float]) -> np.ndarray:
    """(60, 80) image of white squares: column, row, side in pixels, turn in radians."""
    image = np.full((60 * FINE, 80 * FINE), 50, np.uint8)
    for column, row, side, turn in squares:
        half = side / 2 * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        corners = (half @ rotation.T + [column, row] + 0.5) * FINE - 0.5
        cv2.fillConvexPoly(image, np.rint(corners * 256).astype(np.int32), 250, shift=8)
    return cv2.resize(image, (80, 60), interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.785])
def test_a_square_is_measured_to_a_fraction_of_a_pixel(turn: float):
    (spot,) = find_spots(_grey((30.3, 24.8, 11.0, turn)), 150, least=20, most=40)
    assert spot.centre == pytest.approx([30.3, 24.8], abs=0.15)
    assert spot.side == pytest.approx(11.0, abs=0.3) and spot.sides == pytest.approx([11, 11], abs=0.4)
    assert spot.fill > 0.93
    assert np.abs(spot.inside - spot.centre).max() < 11


def test_spots_come_by_size_and_small_ones_are_left_out():
    found = find_spots(_grey((20, 20, 8, 0), (50, 30, 14, 0), (70, 50, 3, 0)), 150, least=20, most=40)
    assert [round(spot.side) for spot in found] == [14, 8]


def test_a_spot_that_is_too_long_is_its_bounding_box():
    (spot,) = find_spots(_grey((40, 30, 30, 0)), 150, least=20, most=20)
    assert spot.centre == pytest.approx([40, 30], abs=1) and spot.sides == pytest.approx([30, 30], abs=1.5)
    assert spot.fill == 0 and len(spot.inside) == 0


def test_a_line_of_a_pixel_a_little_over_the_level_is_no_square():
    image = np.full((60, 80), 50, np.uint8)
    image[20, 10:40] = 151
    (spot,) = find_spots(image, 150, least=20, most=40)
    assert spot.fill == 0 and spot.centre == pytest.approx([24.5, 20.0])


def test_a_neighbour_does_not_shift_a_square():
    alone = find_spots(_grey((30, 30, 10, 0)), 150, least=20, most=40)[0]
    both = find_spots(_grey((30, 30, 10, 0), (43, 30, 12, 0)), 150, least=20, most=40)
    assert min(np.abs(spot.centre - alone.centre).max() for spot in both) < 0.02
