import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from hal.sensor_noise import SensorNoise, add_noise
from mskgrasp.core.errors import NoPartFound
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.scoring import Scene
from tests import synthetic
from tests.synthetic import INTRINSICS, OVERHEAD, REGION, TABLE_Z, TILTED, Box, render

PIXEL = 0.8 / 365.5  # metres that a pixel covers on the table


@pytest.mark.parametrize("yaw", [0.0, np.pi / 2])
def test_a_boxs_view_is_within_a_pixel_and_unbiased(yaw):
    rng = np.random.default_rng(0)
    centres, sizes = [], []
    for _ in range(120):
        size = tuple(rng.uniform([0.02, 0.01, 0.01], [0.1, 0.05, 0.05]))
        box = Box(x=float(rng.uniform(0.37, 0.54)), y=float(rng.uniform(-0.085, 0.085)), yaw=yaw, size=size)
        view = synthetic.view(render([box]))
        along = np.array(size[:2]) if yaw else np.array(size[1::-1])  # image x runs along base -y
        centres.append((view.centre_base - box.T_base_obj.position) / PIXEL)
        sizes.append((view.size[:2] - along) / PIXEL)
        assert view.size[2] == pytest.approx(size[2], abs=1e-5)
    centres, sizes = np.array(centres), np.array(sizes)
    assert np.abs(sizes).max() <= 1.0
    # Half a pixel is what sampling an edge leaves open; on average a third is kept, and nothing is biased.
    assert np.sqrt((centres**2).mean(axis=0)).max() < 1 / 3
    assert np.abs(centres).max() < 0.55
    assert np.abs(centres.mean(axis=0)).max() < 0.06


def test_a_tilted_camera_sees_the_same_box():
    box = Box(x=0.46, y=0.01, yaw=0.0, size=(0.06, 0.03, 0.03))
    view = view_part(render([box], TILTED), INTRINSICS, TILTED, table_z=0.0, region=REGION)
    assert np.abs(view.centre_base - box.T_base_obj.position).max() < 1.5 * PIXEL
    assert np.abs(view.size - [0.03, 0.06, 0.03]).max() < 2 * PIXEL


def test_the_box_frame_lies_along_the_images_axes_with_z_up():
    view = synthetic.view(render([Box(x=0.46, y=0.0, yaw=0.0, size=(0.08, 0.02, 0.03))]))
    assert np.allclose(view.T_base_box.as_matrix()[:3, 0], [0, -1, 0], atol=1e-9)
    assert np.allclose(view.T_base_box.as_matrix()[:3, 2], [0, 0, 1])
    assert view.size[1] > 3 * view.size[0]


def test_the_radius_of_gyration_is_that_of_a_rectangle():
    length, width = 0.08, 0.05
    view = synthetic.view(render([Box(x=0.455, y=0.0, yaw=0.4, size=(length, width, 0.004))]))
    assert view.gyration_radius == pytest.approx(np.sqrt((length**2 + width**2) / 12), rel=0.03)


def test_specks_flying_pixels_and_holes_do_not_move_the_view():
    box = Box(x=0.455, y=0.0, yaw=0.2, size=(0.06, 0.03, 0.03))
    depth = render([box])
    clean = synthetic.view(depth)
    depth[30, 40], depth[31, 41] = 0.7, np.nan  # a speck on the table
    depth[80, 80] = 0.6  # a flying pixel on the part
    depth[78:80, 78:80] = np.nan
    spoilt = synthetic.view(depth)
    assert np.allclose(spoilt.centre_base, clean.centre_base, atol=1e-4)
    assert np.allclose(spoilt.size, clean.size, atol=1e-4)


def test_what_stands_outside_the_region_is_not_the_part():
    part = Box(x=0.455, y=0.0, yaw=0.0, size=(0.03, 0.03, 0.02))
    wall = Box(x=0.455, y=0.19, yaw=0.0, size=(0.3, 0.02, 0.05))
    view = synthetic.view(render([part, wall]))
    assert np.abs(view.centre_base - part.T_base_obj.position).max() < PIXEL


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        (render([]), "nothing rises"),
        (np.full((160, 160), np.nan, np.float32), "no valid pixel"),
        (render([]) * 1000, "millimetres"),
        ((render([]) * 1000).astype(np.uint16), "millimetres"),
        (render([]) + np.linspace(-0.015, 0.015, 160, dtype=np.float32), "the table is tilted"),
        (render([Box(x=0.6, y=0.0, yaw=0.0, size=(0.04, 0.04, 0.03))]), "outside the region"),
    ],
)
def test_an_image_without_a_part_is_reported_in_one_line(depth, words):
    with pytest.raises(NoPartFound, match=words) as caught:
        synthetic.view(depth)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf])
def test_pixels_without_a_depth_are_left_out(nothing):
    depth = render([Box(x=0.5, y=0.0, yaw=0.0, size=(0.04, 0.03, 0.02))])
    partly = depth.copy()
    partly[:35], partly[-35:] = nothing, nothing  # 44 % of the pixels
    assert synthetic.view(partly).size == pytest.approx(synthetic.view(depth).size)


WIDE = np.array([[365.5, 0.0, 119.5], [0.0, 365.5, 119.5], [0.0, 0.0, 1.0]])


def wide_view(boxes, seed=None):
    """What a camera that sees 52 cm of the table detects."""
    depth = render(boxes, intrinsics=WIDE, shape=(240, 240))
    if seed is not None:
        depth = add_noise(depth, WIDE, SensorNoise(model="kinect2"), np.random.default_rng(seed))
    return view_part(depth, WIDE, OVERHEAD, table_z=TABLE_Z, region=REGION, min_height=0.003)


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_a_part_of_which_a_piece_lies_too_far_out_is_refused(seed):
    """Up to 17 mm of it were cut off, and its centre was 8 mm wrong."""
    for x, y, yaw in ((0.56, 0.0, 0.0), (0.455, -0.107, np.pi / 2)):
        with pytest.raises(NoPartFound, match="reaches more than 5 cm beyond the region"):
            wide_view([Box(x=x, y=y, yaw=yaw, size=(0.15, 0.03, 0.03))], seed)


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_a_part_that_reaches_no_farther_is_seen_whole_whatever_stands_farther_out(seed):
    part = Box(x=0.54, y=0.0, yaw=0.0, size=(0.15, 0.03, 0.03))  # up to 4 cm beyond
    wall = Box(x=0.65, y=0.0, yaw=0.0, size=(0.03, 0.2, 0.05))  # from 6 cm
    view = wide_view([part, wall], seed)
    assert np.abs(view.centre_base - part.T_base_obj.position)[:2].max() < 3 * PIXEL


def test_a_region_without_a_depth_is_reported_as_such():
    depth = render([Box(x=0.455, y=0.0, yaw=0.0, size=(0.06, 0.03, 0.03))])
    hole = np.where(np.pad(np.ones((156, 156), bool), 2), np.float32(np.nan), depth)
    for image, region in ((depth, (2.0, 2.2, 0.0, 0.2)), (hole, REGION)):
        with pytest.raises(NoPartFound, match=r"no pixel in the region has a depth \(x "):
            view_part(image, INTRINSICS, OVERHEAD, table_z=TABLE_Z, region=region)


def noisy_view(depth, model, seed, min_height=0.003, **known):
    noisy = add_noise(depth, INTRINSICS, SensorNoise(model=model), np.random.default_rng(seed))
    return view_part(
        noisy,
        INTRINSICS,
        OVERHEAD,
        table_z=TABLE_Z,
        region=REGION,
        min_height=min_height,
        alone=True,
        **known,
    )


@pytest.mark.parametrize("model", ["iid", "kinect2"])
def test_a_flat_part_is_seen_through_noise(model):
    """Of 5 mm, where noise deviates by 3 mm, or a kinect2 measures 2 mm too far everywhere."""
    errors = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x, y, yaw = (float(v) for v in rng.uniform([0.42, -0.05, -1.5], [0.5, 0.05, 1.5]))
        depth = render([Box(x=x, y=y, yaw=yaw, size=(0.06, 0.04, 0.005))])
        view, clean = noisy_view(depth, model, seed), synthetic.view(depth)
        errors.append([*(view.centre_base - clean.centre_base)[:2], *(view.size - clean.size)[:2]])
    # A speck of noise beside the part counts to it.
    assert np.abs(errors).max() < 0.012
    assert np.median(np.abs(errors)) < 0.003


@pytest.mark.parametrize("model", ["iid", "kinect2"])
def test_a_narrow_part_is_one_part_through_noise(model):
    """A pin of 7 mm: three pixels wide."""
    for seed in range(30):
        yaw = float(np.random.default_rng(seed).uniform(-1.5, 1.5))
        depth = render([Box(x=0.455, y=0.0, yaw=yaw, size=(0.065, 0.007, 0.007))])
        assert np.abs(noisy_view(depth, model, seed).centre_base - [0.455, 0.0, 0.0])[:2].max() < 0.01


def test_a_thin_ring_is_one_part_through_the_noise_of_a_kinect():
    """A wall of 2.5 mm, one pixel: half of its pixels float between its top and the table."""
    around = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    size = (0.009, 0.0025, 0.012)
    wall = [
        Box(x=0.455 + 0.033 * np.cos(turn), y=0.033 * np.sin(turn), yaw=turn + np.pi / 2, size=size)
        for turn in around
    ]
    depth = render(wall)
    centres = [noisy_view(depth, "kinect2", seed).centre_base[:2] for seed in range(30)]
    assert np.abs(np.array(centres) - [0.455, 0.0]).max() < 0.006


@pytest.mark.parametrize("degrees", [0.0, 0.6])
def test_two_parts_are_two_through_noise_on_a_tilted_table_too(degrees):
    """The high side of a tilted table rises over half the least height, and leads from one to the other."""
    size, gap = (0.04, 0.04, 0.02), 0.022
    boxes = [Box(x=0.455 + side * (0.04 + gap) / 2, y=-0.09, yaw=0.0, size=size) for side in (-1, 1)]
    depth = render(boxes)
    points_y = (np.arange(depth.shape[0]) - depth.shape[0] / 2)[:, None] * PIXEL
    for sign in (-1.0, 1.0):
        tilted = depth + sign * np.radians(degrees) * points_y
        for seed in range(5):
            with pytest.raises(NoPartFound, match="two things"):
                view_part(
                    noisy(tilted, 0.0005, seed), INTRINSICS, OVERHEAD,
                    table_z=TABLE_Z, region=REGION, min_height=0.003, alone=True,
                )  # fmt: skip


@pytest.mark.parametrize("model", ["iid", "kinect2"])
@pytest.mark.parametrize("part_height", [math.inf, 0.004])
def test_an_empty_table_stays_empty_whatever_the_noise(model, part_height):
    for seed in range(30):
        with pytest.raises(NoPartFound):
            noisy_view(render([]), model, seed, part_height=part_height)


def test_a_wire_of_4_mm_is_seen_through_the_noise_of_a_kinect_where_that_is_what_is_looked_for():
    """Two pixels wide: smoothed, it rises by less than the 3 mm that may be noise."""
    unseen, errors = 0, []
    for seed in range(30):
        yaw = float(np.random.default_rng(seed).uniform(-1.5, 1.5))
        depth = render([Box(x=0.455, y=0.0, yaw=yaw, size=(0.05, 0.004, 0.004))])
        try:
            noisy_view(depth, "kinect2", seed)
        except NoPartFound:
            unseen += 1
        seen = noisy_view(depth, "kinect2", seed, part_height=0.004)
        errors.append(seen.centre_base[:2] - [0.455, 0.0])
    assert unseen > 10
    assert np.abs(errors).max() < 0.015  # an end may be missing


def test_a_part_of_too_few_pixels_is_not_called_an_empty_table():
    speck = Box(x=0.455, y=0.0, yaw=0.0, size=(0.004, 0.003, 0.004))
    with pytest.raises(NoPartFound, match="rises more than 2 mm .* fewer than 5 pixels in one place"):
        view_part(render([speck]), INTRINSICS, OVERHEAD, table_z=TABLE_Z, region=REGION)


def test_a_flat_part_that_is_looked_for_shows_itself_in_an_exact_image():
    box = Box(x=0.455, y=0.0, yaw=0.2, size=(0.06, 0.03, 0.0016))
    with pytest.raises(NoPartFound, match="more than 2 mm"):
        view_part(render([box]), INTRINSICS, OVERHEAD, table_z=TABLE_Z, region=REGION)
    view = view_part(render([box]), INTRINSICS, OVERHEAD, table_z=TABLE_Z, region=REGION, part_height=0.0016)
    assert view.size[2] == pytest.approx(0.0016, abs=1e-5)


def test_a_part_that_is_known_to_be_flat_is_seen_as_before_where_it_rises_high_enough():
    depth = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.03))])
    usual, known = (noisy_view(depth, "kinect2", 0, part_height=one) for one in (math.inf, 0.004))
    assert np.array_equal(usual.centre_base, known.centre_base) and np.array_equal(usual.size, known.size)


def test_a_table_that_is_seen_tilted_is_not_taken_for_a_flat_part():
    """2.6 mm up and down over the region: most of it rises over half of a flat part's height."""
    depth = render([]) + np.linspace(0.0026, -0.0026, 160, dtype=np.float32)
    with pytest.raises(NoPartFound, match="nothing rises"):
        view_part(noisy(depth, 0.0004), INTRINSICS, OVERHEAD, **FIND, part_height=0.001)


def test_noise_does_not_raise_the_top():
    depth = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.03))])
    tops = [noisy_view(depth, "iid", seed).size[2] for seed in range(30)]
    assert np.abs(np.mean(tops) - 0.03) < 0.002 and np.std(tops) < 0.001


FIND = {"table_z": TABLE_Z, "region": REGION, "min_height": 0.003}


def noisy(depth, deviation=0.001, seed=0):
    return depth + np.random.default_rng(seed).normal(0.0, deviation, depth.shape).astype(np.float32)


@pytest.mark.parametrize("offset", [-0.0025, -0.001, 0.001, 0.0025])
@pytest.mark.parametrize("size", [(0.06, 0.04, 0.005), (0.06, 0.007, 0.007), (0.06, 0.04, 0.03)])
def test_heights_count_from_the_table_that_a_noisy_camera_sees(offset, size):
    """Measured 2.5 mm too far, a part of 5 mm rises 2.5 mm over where the table is said to be."""
    depth = render([Box(x=0.455, y=0.0, yaw=0.0, size=size)])
    view = view_part(noisy(depth - np.float32(offset)), INTRINSICS, OVERHEAD, **FIND)
    assert view.table_offset == pytest.approx(offset, abs=2e-4)
    assert view.size == pytest.approx(synthetic.view(depth).size, abs=0.005)
    assert view.size[2] == pytest.approx(size[2], abs=0.0015)
    seen = replace(synthetic.frame([]), depth=noisy(depth - np.float32(offset)))
    scene = Scene.of(seen, view, TABLE_Z, torch.device("cpu"))
    assert abs(float(scene.heights.median())) < 3e-4


@pytest.mark.parametrize("offset", [-0.005, 0.005])
def test_a_table_that_is_seen_far_from_where_it_is_said_to_be_is_an_error(offset):
    depth = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.02))]) - np.float32(offset)
    with pytest.raises(NoPartFound, match=r"the table is seen .5\.. mm from table_z"):
        view_part(noisy(depth), INTRINSICS, OVERHEAD, **FIND)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_holes_in_a_noisy_image_are_not_table(share):
    depth = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.012))])
    clean = synthetic.view(depth)
    holes = noisy(depth, 0.0015)
    holes[np.random.default_rng(1).random(depth.shape) < share] = np.nan
    view = view_part(holes, INTRINSICS, OVERHEAD, **FIND)
    assert view.size == pytest.approx(clean.size, abs=0.006)
    assert view.centre_base == pytest.approx(clean.centre_base, abs=0.003)


def test_more_noise_than_the_least_height_shows_no_parts_that_are_not_there():
    for seed in range(30):
        with pytest.raises(NoPartFound):
            view_part(noisy(render([]), 0.006, seed), INTRINSICS, OVERHEAD, **FIND)


def test_depth_in_steps_of_a_tenth_of_a_millimetre_is_exact_for_a_tilted_camera_too():
    depth = render([Box(x=0.46, y=0.01, yaw=0.3, size=(0.06, 0.03, 0.0025))], TILTED)
    stepped = (depth * 1e4).round().astype(np.float32) * np.float32(1e-4)
    view = view_part(stepped, INTRINSICS, TILTED, table_z=0.0, region=REGION)
    assert view.table_offset == 0.0 and view.size[2] == pytest.approx(0.0025, abs=2e-4)


@pytest.mark.parametrize("deviation", [0.0003, 0.0005, 0.001])
@pytest.mark.parametrize("offset", [-0.0012, 0.0004])
def test_the_table_is_measured_between_the_steps_of_depth_in_whole_millimetres(offset, deviation):
    depth = render([Box(x=0.455, y=0.0, yaw=0.4, size=(0.06, 0.04, 0.02))])
    stepped = np.round(noisy(depth - np.float32(offset), deviation), 3)
    view = view_part(stepped, INTRINSICS, OVERHEAD, **FIND)
    assert view.table_offset == pytest.approx(offset, abs=2e-4)
    assert view.size == pytest.approx(synthetic.view(depth).size, abs=0.004)
