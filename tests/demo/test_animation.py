"""The animation shows the film, and measures the shift of the seen centre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hal.sim import FilmFrame, View
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.demo.animation import write_animation
from mskgrasp.planning.grasp_plan import GraspPlan
from tests.planning.hand_made import FRAME, planner

N = 120
SHIFT, TURN = np.array([2e-3, -5e-3, 0.0]), 0.2


@pytest.fixture(scope="module")
def plan() -> GraspPlan:
    return planner().plan(FRAME, np.random.default_rng(0))


def frame(plan: GraspPlan, seconds: float, motion: Pose, height: float = 0.0) -> FilmFrame:
    """The part after a motion in the grasp frame, in a hand raised by ``height``."""
    lying = Pose(position=plan.view.centre_base, quat_wxyz=quat_about_z(np.array(0.3)))
    T_base_grasp = plan.grasp.T_base_grasp
    moved = T_base_grasp @ motion @ T_base_grasp.inverse() @ lying
    raised = Pose(position=moved.position + [0.0, 0.0, height], quat_wxyz=moved.quat_wxyz)
    part = np.zeros((N, N), bool)
    part[30:90, 50:70] = True
    view = View(colour=np.full((N, N, 3), 120, np.uint8), part=part, fingers=np.zeros_like(part), empty=~part)
    T_base_tcp = plan.grasp.raised(height).T_base_tcp
    return FilmFrame(seconds=seconds, side=view, above=view, T_base_tcp=T_base_tcp, T_base_obj=raised)


def about_the_centre(plan: GraspPlan) -> Pose:
    """The motion in the grasp frame that moves the seen centre by `SHIFT` and turns the part by `TURN`."""
    centre = plan.grasp.T_base_grasp.inverse().apply(plan.view.centre_base)
    turn = quat_about_z(np.array(TURN))
    turned = Pose(position=np.zeros(3), quat_wxyz=turn).apply(centre)
    return Pose(position=centre + SHIFT - turned, quat_wxyz=turn)


STILL = Pose(position=np.zeros(3), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))


def test_the_last_frames_displacement_is_that_of_the_seen_centre(tmp_path: Path, plan: GraspPlan):
    frames = [frame(plan, 0.0, STILL), frame(plan, 1.0, STILL), frame(plan, 2.0, about_the_centre(plan), 0.1)]
    moved = write_animation(frames, plan, tmp_path / "grasp.gif")
    np.testing.assert_allclose(moved, [*SHIFT, TURN], atol=1e-6)


def test_the_film_is_blue_where_the_part_is_and_outlines_where_it_was_and_is_expected(
    tmp_path: Path, plan: GraspPlan
):
    frames = [frame(plan, 0.0, STILL), frame(plan, 0.1, about_the_centre(plan))]
    write_animation(frames, plan, tmp_path / "grasp.gif")
    with Image.open(tmp_path / "grasp.gif") as film:
        assert getattr(film, "n_frames", 1) == 2 and film.info["loop"] == 0
        pixels = np.asarray(film.convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(pixels, -1, 0)
    left, right = pixels.shape[1] // 2, pixels.shape[1]
    is_blue = (blue > 150) & (red < 80)
    assert is_blue[:, :left].sum() > 5000 and is_blue[:, left:right].sum() > 5000
    orange = (red > 200) & (green < 130) & (blue < 60)
    ink = (red < 60) & (green < 60) & (blue < 60)
    panel = slice(30, 340)
    assert orange[panel, left:].sum() > 200 and ink[panel, left:].sum() > 100
    assert orange[panel, :left].sum() == 0
