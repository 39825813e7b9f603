"""Convex pieces: exact partitions, differences and unions."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from mskgrasp.parts.solids.pieces import convex_polygons, split_by
from mskgrasp.parts.solids.shape import block


@given(corners=st.lists(st.tuples(st.floats(5, 40), st.floats(0.05, 1.0)), min_size=4, max_size=14))
def test_a_partition_into_convex_polygons_covers_any_star_shape_once(corners):
    share = np.cumsum([step for _, step in corners])
    angle = 2 * np.pi * share / share[-1]
    outline = np.array([[r * np.cos(a), r * np.sin(a)] for (r, _), a in zip(corners, angle, strict=True)])
    region = shapely.Polygon(outline)
    if not region.is_valid or region.area < 1:
        return
    pieces = convex_polygons(region)
    areas = [shapely.Polygon(piece).area for piece in pieces]
    assert sum(areas) == pytest.approx(region.area, rel=1e-6)
    assert all(
        shapely.Polygon(piece).convex_hull.area <= area * (1 + 1e-5)
        for piece, area in zip(pieces, areas, strict=True)
    )
    assert max(map(len, pieces)) <= 16


@given(size=st.tuples(*[st.floats(2, 30)] * 3), at=st.tuples(*[st.floats(-20, 20)] * 3))
def test_splitting_a_box_by_a_box_leaves_the_difference(size, at):
    whole = np.asarray(block(-10, 10, -10, 10, -10, 10).hulls[0])
    low, high = np.array(at) - np.array(size) / 2, np.array(at) + np.array(size) / 2
    cutter = np.asarray(block(low[0], high[0], low[1], high[1], low[2], high[2]).hulls[0])
    overlap = np.prod(np.clip(np.minimum(high, 10) - np.maximum(low, -10), 0, None))
    left = split_by(whole, cutter)
    assert sum(ConvexHull(points).volume for points in left) == pytest.approx(8000 - overlap, abs=0.05)
