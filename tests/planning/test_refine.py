import numpy as np
import pytest
import torch

from mskgrasp.core.grasp import centre_in_grasp_frame, to_object_displacement
from mskgrasp.perception.part_detection import view_part
from mskgrasp.planning.refine import hand_room, where_held
from mskgrasp.planning.scoring import Scene
from tests import synthetic
from tests.planning.hand_made import BOX
from tests.synthetic import REGION, Box


def test_fingers_that_would_stand_on_another_box_are_not_free():
    other = Box(
        x=BOX.x - 0.055 * np.sin(0.4), y=BOX.y + 0.055 * np.cos(0.4), yaw=0.4, size=(0.02, 0.01, 0.03)
    )
    frame = synthetic.frame([BOX, other])
    view = view_part(frame.depth, frame.intrinsics, frame.T_base_camera, table_z=0.0, region=REGION)
    scene = Scene.of(frame, view, 0.0, torch.device("cpu"))
    grasps = np.array(
        [
            [BOX.x, BOX.y, 0.015, 0.4],  # its second finger would stand on the other box
            [BOX.x, BOX.y, 0.045, 0.4],  # the same above it
            [BOX.x, BOX.y, 0.015, 0.4 - np.pi / 2],  # along the box: 70 mm fit between the fingers
            [BOX.x + 0.02 * np.cos(0.4), BOX.y + 0.02 * np.sin(0.4), 0.015, 0.4 - np.pi / 2],
        ]
    )
    assert hand_room(scene, grasps)[0].tolist() == [False, True, True, False]


def test_a_grasp_at_the_place_where_the_part_is_held_moves_it_no_more():
    rng = np.random.default_rng(0)
    grasps = rng.uniform([-0.1, -0.1, 0.01, -1.0], [0.1, 0.1, 0.03, 1.0], size=(50, 4))
    point = rng.uniform([-0.1, -0.1, 0.01], [0.1, 0.1, 0.01], size=(50, 3))
    moved = rng.uniform([-0.01, -0.01, 0.0, -0.5], [0.01, 0.01, 0.0, 0.5], size=(50, 4))
    held = where_held(grasps, moved)
    # In both the part comes to lie alike in the hand.
    before = centre_in_grasp_frame(point, grasps)
    after = before + to_object_displacement(moved, before)[:, :3]
    assert np.allclose(centre_in_grasp_frame(point, held)[:, :2], after[:, :2], atol=1e-12)
    assert np.array_equal(held[:, 2], grasps[:, 2])
    turned = where_held(np.array([[0, 0, 0.02, 1.4]]), np.array([[0, 0, 0, 0.5]]))
    assert turned[0, 3] == pytest.approx(1.9 - np.pi)  # a jaw is the same after half a turn
