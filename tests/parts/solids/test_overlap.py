"""Overlapping pieces: the same shape, and no face between two pieces near the surface."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType
from scipy.spatial import ConvexHull

from mskgrasp.parts.recipes.families import recipes
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.overlap import REACH_MM, _least_outside, overlapped


def union(hulls):
    return Manifold.batch_boolean([Manifold.hull_points(np.asarray(h, float)) for h in hulls], OpType.Add)


def depth(hulls, point):
    """How deep a point is in the piece in which it is deepest: the shortest way out of that piece, mm."""
    return max(-(ConvexHull(h).equations @ [*point, 1.0]).max() for h in hulls)


NAMES = (
    "hex_nut_m20",
    "washer_m36",
    "bearing_6205",
    "l_bracket_40x40",
    "stepped_shaft_28x95",
    "t_nut_m16x18",
)


@pytest.mark.parametrize("name", NAMES)
def test_the_shape_of_the_whole_is_unchanged(name):
    recipe = recipes()[name]
    before = recipe.make(recipe.dimensions).hulls
    after = overlapped(before)
    assert len(after) == len(before)
    assert sum(ConvexHull(h).volume for h in after) > 1.02 * sum(ConvexHull(h).volume for h in before)
    assert all(len(points) <= s.MAX_HULL_VERTICES for points in after)
    first, second = union(before), union(after)
    assert (first - second).volume() <= 1e-6 * first.volume()
    assert (second - first).volume() <= 1e-4 * first.volume()


def test_a_pad_that_presses_beside_a_joint_is_pushed_straight_back():
    # Halves of a bar that meet at x = 0. A corner of a pad is 0.2 mm deep in the top, 0.05 mm beside the
    # joint: alone, the shortest way out of its half is sideways.
    halves = [s.box(-30, 0, -10, 10, 0, 20), s.box(0, 30, -10, 10, 0, 20)]
    corner = (0.05, 0.0, 19.8)
    assert depth(halves, corner) == pytest.approx(0.05)
    assert depth(overlapped(halves), corner) == pytest.approx(0.2)


def test_pieces_reach_as_deep_as_asked_and_not_twice():
    halves = [s.box(-30, 0, -10, 10, 0, 20), s.box(0, 30, -10, 10, 0, 20)]
    once = overlapped(halves)
    assert once[0][:, 0].max() == pytest.approx(REACH_MM)
    assert once[1][:, 0].min() == pytest.approx(-REACH_MM)
    assert np.array_equal(overlapped(once), once)


def test_a_concave_corner_stays_empty():
    # The legs of an L: the lower one may not reach up along the inner face of the other.
    legs = [s.box(0, 40, 0, 20, 0, 5), s.box(0, 5, 0, 20, 5, 40)]
    after = overlapped(legs)
    assert depth(after, (5.2, 10.0, 5.2)) < 0
    assert (union(after) - union(legs)).volume() < 1e-6


def test_one_piece_and_pieces_apart_stay():
    apart = [s.box(0, 1, 0, 1, 0, 1), s.box(2, 3, 0, 1, 0, 1)]
    for pieces in ([apart[0]], apart):
        assert all(np.array_equal(a, b) for a, b in zip(overlapped(pieces), pieces, strict=True))


def test_a_corner_without_which_the_others_lie_in_a_plane_stays():
    square = np.array([[0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0]], float)
    pyramid = np.vstack([square, [20, 20, 30]])
    tetrahedron = np.vstack([square[[0, 1, 3]], [0, 0, 40]])
    for points in (pyramid, tetrahedron):
        assert np.array_equal(overlapped([points])[0], points)


def test_the_bound_of_what_lies_outside_is_one_and_close():
    """Random bodies, each corner of which is given to the first of them."""
    rng, shares = np.random.default_rng(0), []
    for _ in range(20):
        bodies = [rng.normal(size=(12, 3)) + rng.uniform(0, 3, size=3) for _ in range(3)]
        whole = union(bodies)
        corners = np.concatenate(bodies[1:])
        sides = [ConvexHull(body).equations for body in bodies]
        bounds = _least_outside(ConvexHull(bodies[0]), corners, sides)
        for corner, bound in zip(corners, bounds, strict=True):
            outside = (Manifold.hull_points(np.concatenate([bodies[0], corner[None]])) - whole).volume()
            assert bound <= outside + 1e-9
            if outside > 0.01:
                shares.append(bound / outside)
    assert len(shares) > 100 and np.median(shares) > 0.2
