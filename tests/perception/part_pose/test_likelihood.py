import numpy as np
import pytest

from mskgrasp.perception.part_pose.likelihood import HeightTable, Pixels
from mskgrasp.perception.part_pose.surface import HeightMap

CELL = 0.5e-3
STEP = HeightMap(
    heights=np.repeat([[0.0] * 40 + [0.02] * 40 + [0.0] * 40], 40, axis=0).astype(np.float32),
    corner=np.array([-60 * CELL, -20 * CELL]),
    cell=CELL,
    plane=0.0,
)
"""A bar 20 mm wide along y, from x = -10 mm to 10 mm, 20 mm high."""


def costs(x_mm: float, height_mm: float, *, flying: float, sigma: float = 1e-3) -> float:
    table = HeightTable(STEP, sigma=sigma, soft=CELL, flying=flying)
    point = Pixels(
        x=np.array([1e-3 * x_mm], np.float32),
        y=np.zeros(1, np.float32),
        heights=np.array([1e-3 * height_mm], np.float32),
        origin=np.zeros(2),
    )  # fmt: skip
    return float(table.costs(point, np.zeros((1, 3)))[0, 0])


def test_a_height_is_likely_where_the_map_has_it():
    assert costs(0, 20, flying=0) < costs(0, 18, flying=0) < costs(0, 15, flying=0)
    assert costs(20, 0, flying=0) == pytest.approx(costs(0, 20, flying=0), abs=1e-4)


def test_at_an_edge_either_side_is_as_likely():
    inside, top, table = costs(0, 20, flying=0), costs(10, 20, flying=0), costs(10, 0, flying=0)
    assert top == pytest.approx(table, abs=1e-4)
    assert top - inside == pytest.approx(np.log(2), abs=0.05)


def test_a_height_between_the_sides_of_an_edge_is_likely_only_where_pixels_float():
    assert costs(9, 10, flying=2e-3) < costs(9, 10, flying=0) - 1
    assert costs(0, 10, flying=2e-3) == pytest.approx(costs(0, 10, flying=0), abs=1e-4)


def test_a_part_that_is_moved_and_turned_takes_its_heights_along():
    table = HeightTable(STEP, sigma=1e-3, soft=CELL, flying=0.0)
    xy = np.array([[0.1, 0.1], [0.2, 0.2 + 0.009], [0.2, 0.2 + 0.013]], np.float32) - np.array(
        [0.1, 0.2], np.float32
    )
    pixels = Pixels(x=xy[:, 0], y=xy[:, 1], heights=np.full(3, 0.02, np.float32), origin=np.array([0.1, 0.2]))
    found = table.costs(pixels, np.array([[0.2, 0.2, np.pi / 2]]))[0]
    assert found[2] > found[1] + 3  # the bar is now along x
