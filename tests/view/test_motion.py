"""Playback of a motion."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh
from viser import GuiEvent

from mskgrasp.core.geometry import Pose
from mskgrasp.core.panda_kinematics import HOME
from mskgrasp.view.motion import Motion, Player
from mskgrasp.view.page import Page, Panel
from tests.view.conftest import has_node, pose_of, work

N = 11
MOTION = Motion(
    seconds=np.linspace(0, 0.2, N),
    joints=np.tile(HOME, (N, 1)),
    width=np.linspace(0.08, 0.04, N),
    T_base_obj=Pose(
        position=np.stack([np.full(N, 0.5), np.zeros(N), np.linspace(0, 0.1, N)], axis=1),
        quat_wxyz=np.tile([1.0, 0, 0, 0], (N, 1)),
    ),
)


@pytest.mark.parametrize(("seconds", "index"), [(0.0, 0), (0.019, 0), (0.021, 1), (0.2, N - 1), (9.0, N - 1)])
def test_a_moment_is_the_last_one_before_a_time(seconds: float, index: int):
    assert MOTION.at(seconds) == index


def test_a_motion_is_played_to_its_end_and_can_be_moved_to_any_time(page: Page):
    panel = Panel(page, "p")
    with panel.folder:
        player = Player(page, panel)
    player.clear()  # nothing is there yet
    player.load(MOTION, trimesh.creation.box([0.02, 0.02, 0.02]))
    assert pose_of(page, "/p/motion/part").position[2] == 0
    deadline = time.monotonic() + 20
    while player.time.value < 0.2 and time.monotonic() < deadline:
        page.main.work_once()
    work(page)
    assert pose_of(page, "/p/motion/part").position[2] == pytest.approx(0.1)
    fingers = [pose_of(page, f"/p/motion/arm/hand/{side}").position[1] for side in ("left", "right")]
    assert fingers[1] - fingers[0] == pytest.approx(0.04)
    player.time.value = 0.1
    work(page)
    assert pose_of(page, "/p/motion/part").position[2] == pytest.approx(0.05)
    player.play()
    player._hold(cast(GuiEvent, SimpleNamespace(client="the user's", target=player.time)))
    player.time.value = 0.1
    for _ in range(3):
        work(page)
    assert player.time.value == 0.1  # and does not go on
    player.clear()
    assert not has_node(page, "/p/motion/part")
