"""Distances from keep-outs, against points tried one by one and figures worked out on paper."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.keep_out import (
    CAMERA_SIZE,
    Box,
    Capsule,
    KeepOut,
    box_distance,
    camera_keep_out,
    from_plain,
    segment_distance,
    to_plain,
)
from mskgrasp.core.geometry import Pose

coordinates = st.floats(-1, 1).map(lambda value: round(value, 2))
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)
SHARES = np.linspace(0, 1, 2001)


def tried(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return first + SHARES[:, None] * (second - first)


def from_segment(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    share = np.clip((point - a) @ along / max(float(along @ along), 1e-12), 0, 1)
    return np.linalg.norm(point - a - share[..., None] * along, axis=-1)


@settings(max_examples=300, deadline=None)
@given(points, points, points, points)
def test_the_distance_of_two_segments_is_that_of_their_nearest_points(first, second, a, b):
    """Segments on a grid of centimetres are often parallel, on one line, crossing, or points."""
    nearest = from_segment(tried(first, second), a, b).min()
    found = segment_distance(first, second, a, b)
    assert found <= nearest + 1e-9 and found >= nearest - np.linalg.norm(second - first) / 4000 - 1e-9
    assert segment_distance(a, b, first, second) == pytest.approx(found, abs=1e-9)


@settings(max_examples=300, deadline=None)
@given(points, points, points, points)
def test_the_distance_from_a_box_is_that_of_the_nearest_point(first, second, a, b):
    lower, upper = np.minimum(a, b) - 0.01, np.maximum(a, b) + 0.01
    on_line = tried(first, second)
    nearest = np.linalg.norm(np.maximum(np.maximum(lower - on_line, on_line - upper), 0), axis=-1).min()
    found = box_distance(first, second, lower, upper)
    assert found <= nearest + 1e-9 and found >= nearest - np.linalg.norm(second - first) / 4000 - 1e-9


@settings(max_examples=100, deadline=None)
@given(points, points, points, points, points)
def test_a_segment_that_moves_comes_nearer_by_no_more_than_it_moves(first, second, a, b, way):
    for one in (
        Capsule(name="post", ends=np.stack([a, b]), radius=0.05),
        Box(name="box", lower=np.minimum(a, b) - 0.01, upper=np.maximum(a, b) + 0.01),
    ):
        near, far = one.distance(first, second), one.distance(first + way, second + way)
        assert abs(far - near) <= np.linalg.norm(way) + 1e-9


def test_many_segments_are_measured_at_once():
    rng = np.random.default_rng(0)
    first, second = rng.uniform(-1, 1, (2, 4, 5, 3))
    for one in (
        Capsule(name="post", ends=np.array([[0.2, 0, 0], [0.2, 0, 1]]), radius=0.05),
        Box(name="box", lower=np.zeros(3), upper=np.ones(3)),
    ):
        together = one.distance(first, second)
        assert together.shape == (4, 5)
        assert together[2, 3] == pytest.approx(float(one.distance(first[2, 3], second[2, 3])))


def test_a_post_and_a_box_at_known_distances():
    post = Capsule(name="post", ends=np.array([[0.0, 0, 0], [0, 0, 1]]), radius=0.03)
    across = np.array([0.1, -1, 0.5]), np.array([0.1, 1, 0.5])
    assert post.distance(*across) == pytest.approx(0.07)
    box = Box(name="box", lower=np.array([0.2, -0.5, 0.0]), upper=np.array([0.4, 0.5, 0.4]))
    assert box.distance(*across) == pytest.approx(np.hypot(0.1, 0.1))
    assert box.distance(np.array([0.3, 0, 1]), np.array([0.3, 0, 0.2])) == 0


def test_a_camera_keeps_the_space_of_its_body_behind_the_lens():
    """Looking straight down from 0.8 m, its width along the base's y."""
    T_base_camera = Pose.from_matrix(
        np.array([[0.0, -1, 0, 0.5], [-1, 0, 0, 0.0], [0, 0, -1, 0.8], [0, 0, 0, 1]])
    )
    body = camera_keep_out(T_base_camera)
    width, height, depth = CAMERA_SIZE
    corners = np.array(
        [[x, y, z] for x in (-width / 2, width / 2) for y in (-height / 2, height / 2) for z in (-depth, 0)]
    )
    for shift in (-0.03, 0.03):
        # Caps are round, the corners of a housing are not: one sticks out by 6 mm.
        inside = T_base_camera.apply(corners + [shift, 0, 0])
        assert body.distance(inside, inside).max() < 1e-2
    below = np.array([0.5, 0.0, 0.7])
    assert body.distance(below, below) > 0.08


@pytest.mark.parametrize(
    "one",
    [
        Capsule(name="post", ends=np.array([[0.1, 0, 0], [0, 0.2, 1]]), radius=0.05),
        Box(name="shelf", lower=np.zeros(3), upper=np.ones(3)),
    ],
)
def test_a_shape_survives_a_recording(one: KeepOut):
    again = from_plain(to_plain(one))
    assert type(again) is type(one) and to_plain(again) == to_plain(one)
