"""Images rendered from a box agree with plane geometry, and with what the camera sees."""

from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

from mskgrasp.core.config import read_config
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import HandNetworkConfig
from mskgrasp.learning.samples import HEIGHT_STEP, read_samples
from tests.benchmarks.oracle_images import PAD_ROW, heights, images, mesh_points, sides, underside
from tests.benchmarks.paper_choices import CONFIGS

SHAPE, PIXEL = (65, 33), 0.002
GRASP_HEIGHT = 0.02


@pytest.fixture(scope="module")
def table_shaped() -> np.ndarray:
    """A plate of 40 x 60 x 10 mm, 20 mm over the table, seen from a grasp 20 mm over the table."""
    plate = trimesh.creation.box([0.04, 0.06, 0.01])
    return mesh_points(plate) + np.array([0.0, 0.0, 0.025 - GRASP_HEIGHT], dtype=np.float32)


def test_heights_and_underside_are_those_of_the_plate(table_shaped):
    top = heights(table_shaped, GRASP_HEIGHT, SHAPE, PIXEL)
    bottom = underside(table_shaped, GRASP_HEIGHT, SHAPE, PIXEL)
    inside = np.zeros(SHAPE, bool)
    inside[32 - 14 : 32 + 15, 16 - 9 : 16 + 10] = True  # 58 mm along the closing direction, 38 mm across
    np.testing.assert_allclose(top[inside], 0.03, atol=1e-4)
    np.testing.assert_allclose(bottom[inside], 0.02, atol=1e-4)
    outside = np.ones(SHAPE, bool)
    outside[32 - 16 : 32 + 17, 16 - 11 : 16 + 12] = False
    assert not top[outside].any() and not bottom[outside].any()


def test_the_sides_say_how_far_out_the_part_lies_on_the_side_of_each_pad(table_shaped):
    moved = table_shaped + np.array([0.0, 0.005, 0.0], dtype=np.float32)
    image = sides(moved, SHAPE, PIXEL)
    # The plate reaches from 0 to 10 mm over the grasp; the first row is that of the pads' lower edge.
    first = int(np.ceil(PAD_REACH / PAD_ROW))
    upper, lower = image[31 - first - 8 : 31 - first, 10:23], image[33 + first + 1 : 33 + first + 8, 10:23]
    np.testing.assert_allclose(upper, 0.035, atol=2e-4)
    np.testing.assert_allclose(lower, 0.025, atol=2e-4)
    empty = image[[32, 31, 33, 0, -1]]  # the middle, below the plate, and above it
    np.testing.assert_allclose(empty, -MAX_OPENING / 2)


@pytest.mark.parametrize(("turn", "mirror"), [(True, False), (False, True), (True, True)])
def test_turning_and_mirroring_the_hand_flips_the_sides(turn, mirror):
    """A wedge without any symmetry, seen by the hand and by the hand turned by half a turn or mirrored."""
    corners = np.array([[0, 0, 0], [0.03, 0, 0], [0, 0.025, 0], [0, 0, 0.02], [0.02, 0.01, 0.015]])
    points = mesh_points(trimesh.convex.convex_hull(corners)).astype(np.float64)
    signs = np.array([-1.0 if turn else 1.0, -1.0 if turn != mirror else 1.0, 1.0])
    image, other = sides(points, SHAPE, PIXEL), sides(points * signs, SHAPE, PIXEL)
    flips = tuple(axis for axis, sign in ((1, signs[0]), (0, signs[1])) if sign < 0)
    close = np.abs(np.flip(image, flips) - other) < 1e-6
    assert close.mean() > 0.99  # points on the border of two pixels may fall into either
    assert np.abs(image - other).max() > 0.01


@pytest.mark.slow
def test_rendered_heights_are_what_the_camera_sees(boxes, tmp_path):
    network = read_config(LearningConfig, CONFIGS / "pretrained.yaml").network
    assert isinstance(network, HandNetworkConfig)
    samples = read_samples(boxes.data, network)
    found = images(samples, "heights", network, tmp_path)
    held = samples.success
    seen, exact = (values[held].float() * HEIGHT_STEP for values in (samples.patches[:, 0], found))
    # The camera's pixels are 2.2 mm wide and blur edges; perspective shows a little of the walls.
    assert float(((seen - exact).abs() < 0.001).float().mean()) > 0.93
    on_top = exact > 0.029
    assert float((seen[on_top] - 0.03).abs().median()) < 3e-4
    assert not found[~held].any() and len(list(tmp_path.iterdir())) == 1
    assert torch.equal(images(samples, "heights", network, tmp_path), found)


def test_a_point_of_the_mesh_is_turned_with_the_part():
    """The sign of the turn: a long box at 30 degrees lies along that direction of the image."""
    points = mesh_points(trimesh.creation.box([0.06, 0.004, 0.01]))
    turned = Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.array(np.pi / 6))).apply(points)
    image = heights(turned.astype(np.float32), GRASP_HEIGHT, SHAPE, PIXEL)
    # 20 mm along the box: x = 17.3 mm to the right, y = 10 mm up.
    assert image[32 - 5, 16 + 9] > 0.02 and image[32 + 5, 16 + 9] == 0.0
