"""Planners without a model, on boxes whose best grasps are plain."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import NoGraspFound, NoPartFound
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.grasp import PALM_HEIGHT
from mskgrasp.planning.image_planners import (
    FRICTION_CONE,
    AntipodalPlanner,
    CentroidPlanner,
    edges,
    opposite_edges,
)
from mskgrasp.planning.proposal import view_of
from mskgrasp.planning.scoring import Scene
from tests import synthetic
from tests.planning.workspaces import WORKSPACE
from tests.synthetic import Box

BAR = Box(x=0.45, y=0.02, yaw=0.4, size=(0.09, 0.02, 0.03))  # longer than the hand opens
PLANNERS = {"centroid": CentroidPlanner(WORKSPACE), "antipodal": AntipodalPlanner(WORKSPACE)}


def planned(name: str, box: Box) -> np.ndarray:
    proposed = PLANNERS[name].plan(synthetic.frame([box]), np.random.default_rng(0))
    assert proposed.quality is None and proposed.displacement is None
    return proposed.grasp.as_vector()


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("yaw", [-1.2, 0.0, 0.4, 1.5])
def test_a_bar_is_grasped_across_in_its_middle(name, yaw):
    box = Box(x=0.45, y=0.02, yaw=yaw, size=BAR.size)
    x, y, z, theta = planned(name, box)
    # The pads lie along the long side.
    assert abs(wrap_half_turn(theta - yaw)) < np.radians(6)
    along, across = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) @ [x - 0.45, y - 0.02]
    assert abs(across) < 0.0015 and abs(along) < 0.01
    assert z == pytest.approx(0.015, abs=0.002)


@pytest.mark.parametrize("name", PLANNERS)
def test_the_palm_stays_over_a_tall_part_and_the_pads_over_the_table(name):
    *_, z, _ = planned(name, Box(x=0.45, y=0.0, yaw=0.0, size=(0.05, 0.03, 0.09)))
    assert z + PALM_HEIGHT > 0.09
    *_, z, _ = planned(name, Box(x=0.45, y=0.0, yaw=0.0, size=(0.05, 0.03, 0.006)))
    assert z == pytest.approx(float(WORKSPACE.lowest_grasp_z(np.array([0.45, 0.0]))))


def test_edges_are_found_where_the_box_ends_with_their_normals_outwards():
    frame = synthetic.frame([Box(x=0.45, y=0.02, yaw=0.0, size=(0.07, 0.02, 0.03))])
    scene = Scene.of(frame, view_of(frame, WORKSPACE), 0.0, torch.device("cpu"))
    points, normals = edges(scene, 0.015)
    upper = (points[:, 1] > 0.02) & (abs(points[:, 0] - 0.45) < 0.025)
    assert upper.sum() > 40
    assert points[upper, 1].mean() == pytest.approx(0.03, abs=1e-3)
    assert normals[upper].mean(axis=0) == pytest.approx([0.0, 1.0], abs=0.05)


def test_opposite_edges_are_those_that_face_away_from_each_other_within_the_cone():
    off = FRICTION_CONE + 0.05
    points = np.array([[0.0, 0.0], [0.0, 0.03], [0.0, 0.12]])
    away = np.array([[0.0, -1.0], [0.0, 1.0], [0.0, 1.0]])
    first, second, angle = opposite_edges(points, away)  # the third is out of reach
    assert (
        first.tolist() == [[0.0, 0.0]] and second.tolist() == [[0.0, 0.03]] and angle == pytest.approx([0.0])
    )
    assert not len(opposite_edges(points, -away)[2])  # the two sides of a hole
    turned = np.array([[0.0, -1.0], [np.sin(off), np.cos(off)], [0.0, 1.0]])
    assert not len(opposite_edges(points, turned)[2])
    assert not len(opposite_edges(np.zeros((0, 2)), np.zeros((0, 2)))[2])


def test_a_plate_wider_than_the_hand_has_no_opposite_edges():
    with pytest.raises(NoGraspFound, match="turn the part over"):
        planned("antipodal", Box(x=0.45, y=0.0, yaw=0.2, size=(0.11, 0.11, 0.02)))


@pytest.mark.parametrize("name", PLANNERS)
def test_an_empty_table_has_no_part(name):
    with pytest.raises(NoPartFound):
        PLANNERS[name].plan(synthetic.frame([]), np.random.default_rng(0))
