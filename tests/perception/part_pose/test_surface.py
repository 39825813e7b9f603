import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree
from trimesh.transformations import translation_matrix as translation

from mskgrasp.perception.part_pose.surface import ascending, heights_from, on_plane, sample_surface

BOX = trimesh.creation.box((0.06, 0.03, 0.02), transform=translation([0, 0, 0.01]))
POINTS = ascending(sample_surface(np.asarray(BOX.triangles), 0.5e-3).astype(np.float32))


def test_no_point_of_the_surface_is_farther_than_the_spacing_from_a_sample():
    for mesh in (BOX, trimesh.creation.cylinder(0.02, 0.07, sections=48)):
        samples = sample_surface(np.asarray(mesh.triangles), 0.5e-3)
        surface = trimesh.sample.sample_surface(mesh, 5000, seed=0)[0]
        assert KDTree(samples).query(surface)[0].max() < 0.5e-3
        assert len(samples) < 3 * mesh.area / 0.5e-3**2


def test_of_the_points_over_a_cell_the_highest_is_seen():
    middles = 1e-3 * np.stack(np.meshgrid(np.arange(20), np.arange(30)), axis=-1).reshape(-1, 2)
    heights = np.random.default_rng(0).uniform(0, 0.009, size=(len(middles), 20))
    heights[:, 7] = 0.01
    below = np.column_stack([np.repeat(middles, 20, axis=0), heights.ravel()])
    seen = heights_from(ascending(below.astype(np.float32)), None, plane=0.0, cell=1e-3, margin=0.0)
    assert seen.heights.shape == (30, 20) and np.all(seen.heights == np.float32(0.01))


def test_from_straight_above_a_box_is_as_large_as_its_top():
    seen = heights_from(POINTS, None, plane=0.0, cell=0.75e-3, margin=3e-3)
    covered = np.count_nonzero(seen.heights) * seen.cell**2
    assert covered == pytest.approx(0.06 * 0.03, rel=0.06)  # half a cell more at every edge
    assert seen.heights.max() == pytest.approx(0.02, abs=1e-6)
    assert np.allclose(seen.heights[seen.heights > 0], 0.02, atol=1e-6)


def test_an_eye_beside_a_box_sees_its_wall_and_its_top_farther_away():
    eye = np.array([-0.2, 0.0, 0.8])
    seen = heights_from(POINTS, eye, plane=0.0, cell=0.75e-3, margin=3e-3)
    row = seen.heights[seen.heights.shape[0] // 2]
    x = seen.corner[0] + seen.cell * np.arange(len(row))
    # By similar triangles, the top's far edge covers the table up to there.
    assert x[row > 0].max() == pytest.approx(-0.2 + (0.03 + 0.2) * 0.8 / 0.78, abs=seen.cell)
    assert x[row > 0].min() == pytest.approx(-0.03, abs=seen.cell)
    wall = row[(row > 0) & (row < 0.019)]
    assert len(wall) > 2 and np.all(np.diff(wall) > 0)


def test_rays_meet_the_plane_where_similar_triangles_say():
    points = np.array([[0.1, 0.05, 0.4]], np.float32)
    x, y = on_plane(points, np.array([0.0, 0.0, 0.8]), 0.0)
    assert (float(x[0]), float(y[0])) == pytest.approx((0.2, 0.1), rel=1e-5)


def test_bounds_hold_the_heights_of_the_surroundings():
    seen = heights_from(POINTS, None, plane=0.0, cell=0.75e-3, margin=6e-3)
    low, high = seen.bounds(3e-3)
    assert np.all(low <= seen.heights) and np.all(high >= seen.heights)
    grown = np.count_nonzero(high) * seen.cell**2
    assert grown == pytest.approx((0.06 + 6e-3) * (0.03 + 6e-3), rel=0.08)


@pytest.mark.parametrize("turn", [0.0, 0.1, np.pi / 4])
def test_a_slit_nearly_two_cells_wide_stays_open(turn):
    cell, gap = 0.75e-3, 1.4e-3
    halves = [
        trimesh.creation.box((0.03, 0.03, 0.02), transform=translation([side * (0.03 + gap) / 2, 0, 0.01]))
        for side in (-1, 1)
    ]
    both = trimesh.util.concatenate(halves)
    both.apply_transform(trimesh.transformations.rotation_matrix(turn, [0, 0, 1]))
    points = ascending(sample_surface(np.asarray(both.triangles), 0.5e-3).astype(np.float32))
    seen = heights_from(points, None, plane=0.0, cell=cell, margin=3e-3)
    low, _ = seen.bounds(cell)
    along = np.linspace(-0.012, 0.012, 25)
    x, y = -np.sin(turn) * along, np.cos(turn) * along
    column, row = (np.rint((v - c) / cell).astype(int) for v, c in zip((x, y), seen.corner, strict=True))
    assert np.all(low[row, column] == 0)


def test_a_padded_map_shows_the_table_around_the_part():
    seen = heights_from(POINTS, None, plane=0.0, cell=0.75e-3, margin=1e-3)
    padded = seen.padded(3e-3)
    _, high = padded.bounds(3e-3)
    assert high[0].max() == high[-1].max() == high[:, 0].max() == high[:, -1].max() == 0
    inside = padded.heights[4:-4, 4:-4]
    assert np.array_equal(inside, seen.heights)
    assert padded.corner == pytest.approx(seen.corner - 4 * seen.cell)
