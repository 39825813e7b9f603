import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import Pose, quat_multiply, quat_rotate
from mskgrasp.perception.part_pose.likelihood import (
    FLYING,
    ExactHeights,
    HeightLikelihood,
    HeightTable,
    Pixels,
    Seen,
)
from mskgrasp.perception.part_pose.surface import HeightMap, Surface
from tests.perception.part_pose.cells import heights_by_rays, kinect2, known, posed, resting_at, seen

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
    pixels = seen(cell, frame, NAME)
    lying = next(look for look in known(NAME).looks if look.poses[0].resting == 0).poses[0]
    assert lying.surface is not None
    return ExactHeights(lying.surface, pose, pixels), pixels.heights


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


def test_exact_heights_are_where_the_rays_of_a_tilted_camera_meet_the_part():
    """Pixels twice as wide as high, from a camera that looks 30 degrees from the vertical."""
    cone = trimesh.creation.cone(0.03, 0.04, sections=9)
    half = np.radians(30) / 2
    looks_down = np.array([0.0, 1.0, 0.0, 0.0])
    T_table_camera = Pose(
        position=np.array([0.5, -0.4, 0.7]),
        quat_wxyz=quat_multiply(np.array([np.cos(half), np.sin(half), 0, 0]), looks_down),
    )
    intrinsics, shape = np.array([[400.0, 0, 30], [0, 800.0, 60], [0, 0, 1]]), (121, 61)
    pixels = shape[0] * shape[1]
    camera = Seen(
        points=np.zeros((pixels, 3)), heights=np.zeros(pixels), on_part=np.ones(pixels, bool),
        window=np.ones(shape, bool), intrinsics=intrinsics, T_table_camera=T_table_camera, sigma=1e-3,
        noisy=True, smoothed=False, pitch=2e-3, centre=np.zeros(2), size=np.zeros(2),
    )  # fmt: skip
    pose = np.array([0.5, 0.0, 0.7])
    surface = Surface(vertices=np.asarray(cone.vertices), faces=np.asarray(cone.faces, np.int32))
    found = ExactHeights(surface, pose, camera).heights

    rows, columns = np.mgrid[: shape[0], : shape[1]].reshape(2, -1)
    rays = np.column_stack([(columns - 30) / 400, (rows - 60) / 800, np.ones(pixels)])
    along = quat_rotate(T_table_camera.quat_wxyz, rays)
    cone.apply_transform(trimesh.transformations.rotation_matrix(0.7, [0, 0, 1]))
    cone.apply_translation([0.5, 0.0, 0.0])
    true = heights_by_rays(cone, np.tile(T_table_camera.position, (pixels, 1)), along)
    assert np.count_nonzero(true > 1e-3) > 300
    assert np.count_nonzero(np.abs(found - true) > 1e-5) <= 3  # rays along the silhouette


def test_the_excess_of_heights_that_follow_the_model_has_the_mean_and_variance_that_are_told():
    rng, sigma, n = np.random.default_rng(0), 1e-3, 40_000
    low, high = np.zeros(1, np.float32), np.full(1, 0.03, np.float32)
    for edge, share in ((None, 0.0), ((low, high), FLYING)):
        model = HeightLikelihood(low, low, sigma=sigma, edge=edge)
        heights = sigma * rng.standard_normal(n)
        heights += np.where(rng.random(n) < share, rng.uniform(0.005, 0.03, n), 0.0)
        excess, variance = model.excess(heights.astype(np.float32), np.zeros(n, int))
        assert excess.mean() == pytest.approx(0.45, abs=0.2)
        assert excess.var() == pytest.approx(variance[0], rel=0.35)
