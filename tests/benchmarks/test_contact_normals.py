"""Exact distances and directions of convex shapes, and how contacts are judged by them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tests.benchmarks.contact_normals import KINDS, Tried, kind, least_distance, tables

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float) * 0.01


@pytest.mark.parametrize("apart", [(0.001, 0, 0), (0.0003, -0.0004, 0), (0.0001, 0.0002, -0.0002)])
def test_cubes_are_as_far_apart_as_their_faces_edges_or_corners(apart: tuple[float, float, float]):
    way = np.array(apart)
    other = CUBE + way + 0.01 * np.sign(way)
    length, between = least_distance(other, CUBE)
    assert length == pytest.approx(float(np.linalg.norm(way)), rel=1e-4)
    np.testing.assert_allclose(between, way, atol=1e-8)


def test_a_normal_of_a_face_is_wrong_where_edges_meet():
    tried = Tried()
    beside = CUBE + [0.01 + 3e-4, 0.01 + 4e-4, 0.0]
    for normal, separation in (([0.6, 0.8, 0.0], 5e-4), ([0.0, 1.0, 0.0], 4e-4)):
        tried.add(beside, CUBE, np.array(normal), separation, 10.0)
    assert tried.angle == pytest.approx([0.0, np.arctan2(3e-4, 0.5e-4)], abs=1e-4)
    assert tried.distance == pytest.approx([5e-4, 5e-4], rel=1e-4)
    assert tried.wrong == pytest.approx(0.5)


def test_contacts_that_hardly_press_do_not_count():
    tried = Tried(failure="missed")
    tried.add(CUBE + [0.02, 0, 0], CUBE, np.array([0.0, 1.0, 0.0]), 0.0, 0.1)
    assert tried.force == [] and tried.row() == ["missed", "0%", "", ""]


def test_grasps_are_grouped_by_how_their_outcomes_compare():
    held = Tried(
        failure="none", displacement=np.zeros(4), force=[10.0, 10.0], angle=[0.0, 0.3], distance=[0, 2e-4]
    )
    far = dataclasses.replace(held, displacement=np.array([0.004, 0, 0, 0]), angle=[0.0, 0.0])
    lost = Tried(failure="slipped", force=[10.0], angle=[0.01], distance=[0.0])
    tried = [("one (0)", held, lost), ("one (1)", held, far), ("one (2)", far, far)]
    assert [kind(*pair) for _, *pair in tried] == list(KINDS)
    groups, each = tables(tried)
    assert groups.rows == [
        (KINDS[0], 1, "100%", "0%"), (KINDS[1], 1, "100%", "0%"), (KINDS[2], 1, "0%", "0%"),
    ]  # fmt: skip
    assert each.rows[0] == ("one (0)", "held", "50%", "17", "0.20", "slipped", "0%", "", "")
    assert len(each.rows) == 2
