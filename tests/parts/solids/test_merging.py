"""Unions of convex pieces."""

import numpy as np
from scipy.spatial import ConvexHull

from mskgrasp.parts.solids.merging import merge_hulls, merge_in_steps
from mskgrasp.parts.solids.shape import block


def test_merging_stays_within_the_slack():
    steps = [block(10 * n, 10 * n + 10, 0, 10, 0, 10 + n).hulls[0] for n in range(6)]
    volume = sum(ConvexHull(points).volume for points in steps)
    for slack in (0.002, 0.02, 0.1):
        merged = merge_hulls(steps, slack)
        assert sum(ConvexHull(points).volume for points in merged) <= (1 + slack) * volume + 1e-6
    assert len(merge_hulls(steps, 0.1)) < len(merge_hulls(steps, 0.002)) == 6


def test_several_slacks_at_once_give_what_each_gives_alone():
    steps = [block(10 * n, 10 * n + 10, 0, 10, 0, 10 + n % 3).hulls[0] for n in range(8)]
    slacks = (0.001, 0.005, 0.02, 0.1)
    together = merge_in_steps(steps, slacks)
    assert len({len(pieces) for pieces in together}) > 2
    for slack, pieces in zip(slacks, together, strict=True):
        alone = merge_hulls(steps, slack)
        assert len(alone) == len(pieces)
        assert all(np.array_equal(a, b) for a, b in zip(alone, pieces, strict=True))
