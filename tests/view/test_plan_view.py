"""A plan drawn over its depth image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import Pose
from mskgrasp.perception.part_detection import view_part
from mskgrasp.view.ghosts import expected_motion
from mskgrasp.view.page import Page, Panel
from mskgrasp.view.plan_view import PlanView, Shown
from tests.planning.hand_made import BOX, FRAME, planner
from tests.synthetic import REGION
from tests.view.conftest import has_node, node, pose_of, work

PLAN = planner().plan(FRAME, np.random.default_rng(0))
SHOWN = Shown(frame=FRAME, table_z=0.0, region=REGION, plan=PLAN)


@pytest.fixture
def view(page: Page) -> PlanView:
    panel = Panel(page, "p")
    with panel.folder:
        return PlanView(page, panel)


def test_candidates_under_the_least_quality_are_not_drawn(page: Page, view: PlanView):
    view.show(SHOWN)
    assert len(node(page, "/p/plan/candidates/points").points) == len(PLAN.candidates)
    least = float(np.median(PLAN.qualities))
    view.least.value = least
    work(page)
    assert len(node(page, "/p/plan/candidates/points").points) == (PLAN.qualities >= least).sum()
    view.candidates.value = False
    work(page)
    assert not has_node(page, "/p/plan/candidates") and has_node(page, "/p/plan/chosen")


def test_the_depth_image_is_drawn_where_it_was_seen(page: Page, view: PlanView):
    view.show(SHOWN)
    points = node(page, "/p/plan/cloud").points
    seen = view_part(
        FRAME.depth, FRAME.intrinsics, FRAME.T_base_camera, table_z=0.0, region=REGION, min_height=0.002
    )
    assert points[:, 2].max() == pytest.approx(BOX.size[2], abs=1e-4)
    high = points[points[:, 2] > 0.01][:, :2]
    np.testing.assert_allclose((high.max(axis=0) + high.min(axis=0)) / 2, seen.centre_base[:2], atol=2e-3)


def test_the_ghost_of_an_unknown_part_is_made_of_its_points_and_nothing_of_the_table(
    page: Page, view: PlanView
):
    view.show(SHOWN)
    ghost = node(page, "/p/plan/expected").points.astype(np.float64)
    before = expected_motion(PLAN).inverse().apply(ghost)
    assert len(before) > 50 and before[:, 2].min() > 0.001
    low, high = before[:, :2].min(axis=0), before[:, :2].max(axis=0)
    np.testing.assert_allclose((low + high) / 2, [BOX.x, BOX.y], atol=3e-3)


def test_the_ghost_of_a_known_part_is_its_mesh_where_it_is_expected(page: Page, view: PlanView):
    lying = Pose(position=np.array([BOX.x, BOX.y, 0.015]), quat_wxyz=np.array([1.0, 0, 0, 0]))
    mesh = trimesh.creation.box(BOX.size)
    measured = np.array([0.002, 0.0, np.nan, 0.0])
    view.show(replace(SHOWN, mesh=mesh, T_base_obj=lying, measured=measured))
    expected = expected_motion(PLAN) @ lying
    np.testing.assert_allclose(pose_of(page, "/p/plan/expected").position, expected.position, atol=1e-9)
    along = PLAN.grasp.T_base_grasp.apply(np.array([0.002, 0, 0])) - PLAN.grasp.position
    np.testing.assert_allclose(pose_of(page, "/p/plan/measured").position, lying.position + along, atol=1e-9)
    assert not has_node(page, "/p/plan/spread0")
    view.spread.value = True
    work(page)
    assert has_node(page, "/p/plan/spread7")


def test_the_arrow_is_as_many_times_as_long_as_the_control_says(page: Page, view: PlanView):
    lengths = []
    for times in (1, 10):
        view.magnified.value = times
        view.show(SHOWN)
        (arrow,) = node(page, "/p/plan/shift/arrow").points
        lengths.append(np.linalg.norm(arrow[1] - arrow[0]))
        assert has_node(page, "/p/plan/shift/label") is (times != 1)
    np.testing.assert_allclose(lengths, np.linalg.norm(PLAN.displacement[:3]) * np.array([1, 10]), rtol=1e-5)


def test_nothing_is_left_of_a_plan_that_is_no_longer_shown(page: Page, view: PlanView):
    view.show(SHOWN)
    view.show(replace(SHOWN, plan=None))
    assert has_node(page, "/p/plan/cloud") and not has_node(page, "/p/plan/candidates")
    view.show(None)
    assert not has_node(page, "/p/plan/cloud")
