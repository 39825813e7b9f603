"""Nodes of parts, hands, arms, grasps and shifts."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, quat_about_z, quat_to_matrix
from mskgrasp.core.grasp import PALM_HEIGHT, Grasp
from mskgrasp.core.palette import BLUE
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import HOME, forward_pose
from mskgrasp.core.settings import REGION
from mskgrasp.parts import find_part
from mskgrasp.view.page import Page
from mskgrasp.view.scene import (
    AROUND,
    CLOSING,
    LINES,
    TABLE_POINTS,
    ArmNode,
    HandNode,
    add_candidates,
    add_hulls,
    add_shift,
    closing_lines,
    colours_of,
    drawn_points,
    near_region,
    rgb,
)
from tests.view.conftest import has_node, node, pose_of

GRASPS = Grasp.from_vector(np.array([[0.5, 0.02, 0.03, 0.0], [0.45, 0.0, 0.02, np.pi / 4]]))


def test_colours_are_those_of_the_palette_and_an_unknown_quality_is_grey():
    assert rgb("#1f6feb") == rgb(BLUE) == (31, 111, 235)
    low, high, unknown = colours_of(np.array([0.0, 1.0, np.nan]))
    assert high[1] > 200 > low[1]  # from violet to yellow
    assert np.ptp(unknown.astype(int)) < 20


def test_a_candidate_is_a_line_through_its_grasp_along_which_the_fingers_close():
    lines = closing_lines(GRASPS)
    np.testing.assert_allclose(lines.mean(axis=1), GRASPS.position)
    np.testing.assert_allclose(lines[0, 1] - lines[0, 0], [0, CLOSING, 0], atol=1e-12)
    half = CLOSING / np.sqrt(2)
    np.testing.assert_allclose(lines[1, 1] - lines[1, 0], [-half, half, 0], atol=1e-12)


@pytest.mark.parametrize("known", [True, False])
def test_all_candidates_are_points_and_the_best_have_lines(page: Page, known: bool):
    rng = np.random.default_rng(0)
    grasps = Grasp.from_vector(rng.uniform(-0.2, 0.2, (3200, 4)))
    qualities = rng.uniform(size=3200) if known else np.full(3200, np.nan)
    add_candidates(page.scene, "/c", grasps, qualities)
    assert len(node(page, "/c/points").points) == 3200
    middles = node(page, "/c/lines").points.mean(axis=1)
    best = grasps[np.argsort(-qualities)[:LINES]] if known else grasps[:LINES]
    np.testing.assert_allclose(middles, best.position, atol=1e-6)


def test_of_the_table_some_points_are_drawn_and_of_what_lies_on_it_all():
    x, y = np.mean(REGION[:2]), np.mean(REGION[2:])
    table = np.tile([x, y, 0.0], (2 * TABLE_POINTS, 1))
    part = np.tile([x, y, 0.01], (10, 1))
    drawn = drawn_points(np.concatenate([table, part]), REGION, 0.0)
    assert drawn[: len(table)].sum() == TABLE_POINTS and drawn[len(table) :].all()


@pytest.mark.parametrize("width", [0.0, 0.05])
def test_the_pads_of_the_hand_are_as_far_apart_as_told_and_the_palm_is_above(page: Page, width: float):
    HandNode(page.scene, "/hand").place(GRASPS[1].T_base_tcp, width)
    base = pose_of(page, "/hand")
    faces = [base @ pose_of(page, f"/hand/{side}") for side in ("left", "right")]
    apart = faces[1].position - faces[0].position
    assert np.linalg.norm(apart) == pytest.approx(width)
    np.testing.assert_allclose((faces[0].position + faces[1].position) / 2, GRASPS.position[1], atol=1e-9)
    if width:
        np.testing.assert_allclose(apart / width, [-np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-6)
    palm = base.apply(np.asarray(node(page, "/hand/palm").vertices, dtype=np.float64))
    assert palm[:, 2].min() == pytest.approx(GRASPS.position[1, 2] + PALM_HEIGHT, abs=1e-6)


def test_the_links_of_an_arm_follow_its_joints(page: Page):
    arm = ArmNode(page.scene, "/arm", PANDA_LINKS)
    joints = np.array(HOME) + 0.1
    arm.place(joints, forward_pose(joints), 0.04)
    np.testing.assert_allclose(pose_of(page, "/arm/7").position, forward_pose(joints).position, atol=1e-9)
    first, second = PANDA_LINKS.segments(joints)
    for number, one in enumerate(PANDA_LINKS.capsules):
        if one.name == "fingers":
            continue
        name = f"/arm/{one.frame}/{number}"
        pose = pose_of(page, f"/arm/{one.frame}") @ pose_of(page, name)
        points = pose.apply(np.asarray(node(page, name).vertices, dtype=np.float64))
        np.testing.assert_allclose(
            (points.max(axis=0) + points.min(axis=0)) / 2, (first[number] + second[number]) / 2, atol=3e-3
        )
        along = second[number] - first[number]
        reach = np.linalg.norm(points - (first[number] + second[number]) / 2, axis=1).max()
        assert reach == pytest.approx(np.linalg.norm(along) / 2 + one.radius, abs=1e-3)


def test_an_arm_of_unknown_links_is_its_hand(page: Page):
    ArmNode(page.scene, "/arm", None).place(np.zeros(6), GRASPS[0].T_base_tcp, 0.08)
    np.testing.assert_allclose(pose_of(page, "/arm/hand").position, GRASPS.position[0])
    assert not has_node(page, "/arm/0")


def test_the_ellipsoid_has_two_standard_deviations_along_its_axes_and_is_at_the_end_of_the_arrow(page: Page):
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    covariance = turn @ np.diag([1e-6, 4e-6, 9e-6]) @ turn.T
    start = Pose(position=np.array([0.5, 0.0, 0.05]), quat_wxyz=quat_about_z(np.asarray(0.3)))
    add_shift(page.scene, "/shift", start, np.array([0.01, 0.0, 0.0]), covariance, (1, 2, 3))
    found = node(page, "/shift/ellipsoid")
    np.testing.assert_allclose(np.sort(found.scale), [2e-3, 4e-3, 6e-3], rtol=1e-6)
    pose = pose_of(page, "/shift/ellipsoid")
    np.testing.assert_allclose(pose.position, [0.01, 0, 0])
    axes = quat_to_matrix(pose.quat_wxyz)
    shape = axes @ np.diag(np.array(found.scale) ** 2) @ axes.T
    np.testing.assert_allclose(shape, 4 * covariance, atol=1e-12)
    np.testing.assert_allclose(pose_of(page, "/shift").position, start.position)


def test_a_shift_of_unknown_variance_has_no_ellipsoid(page: Page):
    add_shift(page.scene, "/s", Pose.identity(), np.array([0.01, 0, 0]), np.full((3, 3), np.nan), (1, 2, 3))
    assert has_node(page, "/s/arrow") and not has_node(page, "/s/ellipsoid")


def test_points_far_from_the_region_or_without_depth_are_not_drawn():
    x, y = REGION[1] + AROUND, (REGION[2] + REGION[3]) / 2
    points = np.array([[x - 0.001, y, 0.0], [x + 0.001, y, 0.0], [np.nan] * 3])
    assert near_region(points, REGION).tolist() == [True, False, False]


def test_every_hull_of_a_part_is_a_node(page: Page):
    part = find_part("hex_nut_m30")
    page.scene.add_frame("/p")
    add_hulls(page.scene, "/p", part)
    assert has_node(page, f"/p/{part.n_hulls - 1}") and not has_node(page, f"/p/{part.n_hulls}")
    points = np.concatenate([np.asarray(node(page, f"/p/{i}").vertices) for i in range(part.n_hulls)])
    np.testing.assert_allclose(np.ptp(points, axis=0), part.extents, atol=2 * part.hull_error)
