import numpy as np
import pytest

from mskgrasp.perception.part_detection import find_part_pixels
from mskgrasp.perception.part_pose.likelihood import ExactHeights, HeightTable, Pixels
from mskgrasp.perception.part_pose.part_pose import see
from mskgrasp.perception.part_pose.surface import HeightMap
from tests.perception.part_pose.cells import kinect2, known, posed, resting_at

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


NAME = "l_bracket_60x40"
PLACE = np.array([0.47, -0.06, 0.9])


def exact(cell, pose: np.ndarray, *, noisy: bool) -> tuple[ExactHeights, np.ndarray]:
    """What is seen of a bracket at a pose, in an image of it at ``PLACE``; and the heights measured there."""
    frame = posed(cell, NAME, resting_at(NAME, 0, *PLACE))
    frame = kinect2(frame, seed=3) if noisy else frame
    found = find_part_pixels(
        frame.depth, frame.intrinsics, frame.T_base_camera,
        table_z=0.0, region=cell.workspace.region, min_height=0.003,
    )  # fmt: skip
    seen = see(found, frame, known(NAME), 0.0)
    lying = next(look for look in known(NAME).looks if look.poses[0].resting == 0).poses[0]
    assert lying.surface is not None
    return ExactHeights(lying.surface, pose, seen), seen.heights


def test_exact_heights_are_those_that_a_camera_sees(mujoco_cell):
    found, measured = exact(mujoco_cell, PLACE, noisy=False)
    off = np.abs(found.heights - measured)
    assert np.median(off) < 0.05e-3 and np.count_nonzero(found.heights > 1e-3) > 300
    assert np.mean(off > 0.3e-3) < 0.01  # rays that pass an edge by a hair
    assert np.all(found.near_low <= found.heights) and np.all(found.heights <= found.near_high)


def test_exact_heights_of_a_part_elsewhere_cost_more(mujoco_cell):
    for noisy, least in ((False, 100), (True, 30)):
        here, _ = exact(mujoco_cell, PLACE, noisy=noisy)
        beside, _ = exact(mujoco_cell, PLACE + [1.5e-3, 0, 0], noisy=noisy)
        assert beside.costs().sum(dtype=float) > here.costs().sum(dtype=float) + least


def test_the_mean_excess_of_exact_heights_is_half_where_all_is_noise(mujoco_cell):
    found, _ = exact(mujoco_cell, PLACE, noisy=True)
    excess, variance = found.excess()
    part = found.heights > 0
    sigma = np.sqrt(variance[part].sum()) / np.count_nonzero(part)
    assert sigma < 0.05 and abs(excess[part].mean() - 0.5) < 5 * sigma
