"""The simulated Panda: its frames and the size of its hand."""

from __future__ import annotations

import itertools
from xml.etree import ElementTree

import numpy as np
import pytest
import torch

from mskgrasp.core.grasp import FINGER_HALF_WIDTH, FINGER_THICKNESS, PAD_REACH, PALM_HEIGHT
from mskgrasp.core.panda_kinematics import HOME, forward_pose, top_down
from tasks.attempt.clearance import MARGIN
from tasks.robot.panda import BARE_FRAMES


def test_without_bare_frames_the_hand_is_where_it_was(env):
    links = env.agent.robot.links_map
    assert not set(BARE_FRAMES) & set(links)
    q = np.array(HOME) + np.array([0.2, 0.1, -0.15, -0.1, 0.3, 0.2, -0.4])
    env.motion.place(q[None])
    expected = forward_pose(q)
    assert env.tcp_pose().position[0].numpy() == pytest.approx(expected.position, abs=1e-5)
    assert abs(env.tcp_pose().quat_wxyz[0].numpy() @ expected.quat_wxyz) == pytest.approx(1, abs=1e-6)
    masses = (float(mass.get("value", "0")) for mass in ElementTree.parse(env.agent.urdf_path).iter("mass"))
    assert sum(float(link._objs[0].mass) for link in links.values()) == pytest.approx(sum(masses), abs=1e-4)


def test_the_hand_is_as_large_as_its_collision_shapes(env):
    grasp = torch.tensor([[0.5, 0.0, 0.25, 0.0]], dtype=torch.float64)
    env.motion.place(top_down(grasp)[0])
    tcp = env.agent.tcp._objs[0].entity.pose
    corners = {}
    for name in ("panda_hand", "panda_leftfinger", "panda_rightfinger"):
        link = env.agent.robot.links_map[name]._objs[0]
        for shape in link.collision_shapes:
            matrix = (tcp.inv() * link.entity.pose * shape.local_pose).to_transformation_matrix()
            local = (
                shape.vertices * shape.scale
                if hasattr(shape, "vertices")
                else np.array(list(itertools.product((-1, 1), repeat=3))) * shape.half_size
            )
            corners.setdefault(name, []).append(local @ matrix[:3, :3].T + matrix[:3, 3])
    fingers = np.concatenate(corners["panda_leftfinger"] + corners["panda_rightfinger"])
    slack = 2e-4
    assert np.abs(fingers[:, 0]).max() == pytest.approx(FINGER_HALF_WIDTH, abs=slack)
    assert np.abs(fingers[:, 1]).min() == pytest.approx(0.04, abs=slack)
    assert np.abs(fingers[:, 1]).max() == pytest.approx(0.04 + FINGER_THICKNESS, abs=slack)
    assert fingers[:, 2].max() == pytest.approx(PAD_REACH, abs=slack)
    # z of the TCP points down: the palm's lowest point has the greatest.
    assert np.concatenate(corners["panda_hand"])[:, 2].max() == pytest.approx(-PALM_HEIGHT, abs=slack)
    assert slack < MARGIN
