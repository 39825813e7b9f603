import numpy as np
import pytest
import trimesh
from trimesh.transformations import translation_matrix as translation

from mskgrasp.core.geometry import quat_about_z
from mskgrasp.perception.part_pose.surface import Surface, heights_from, on_plane
from tests.perception.part_pose.cells import heights_by_rays


def surface_of(mesh: trimesh.Trimesh) -> Surface:
    return Surface(vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.faces, np.int32))


BOX = surface_of(trimesh.creation.box((0.06, 0.03, 0.02), transform=translation([0, 0, 0.01])))


def test_from_straight_above_a_box_is_as_large_as_its_top():
    seen = heights_from(BOX, None, plane=0.0, cell=0.75e-3, margin=3e-3)
    covered = np.count_nonzero(seen.heights) * seen.cell**2
    assert covered == pytest.approx(0.06 * 0.03, rel=0.04)
    assert np.allclose(seen.heights[seen.heights > 0], 0.02, atol=1e-6)


@pytest.mark.parametrize("eye", [None, (0.1, -0.05, 0.8)])
def test_heights_are_where_rays_meet_the_mesh(eye):
    cone = trimesh.creation.cone(0.03, 0.04, sections=11)
    plane, cell = 0.02, 1e-3
    seen = heights_from(
        surface_of(cone), None if eye is None else np.array(eye), plane=plane, cell=cell, margin=2e-3
    )
    rows, columns = np.mgrid[: seen.heights.shape[0], : seen.heights.shape[1]]
    middles = np.stack([columns, rows], axis=-1).reshape(-1, 2) * cell + seen.corner
    on = np.column_stack([middles, np.full(len(middles), plane)])
    start = on + [0, 0, 1] if eye is None else np.broadcast_to(eye, on.shape)
    heights = heights_by_rays(cone, start, on - start)
    off = np.abs(seen.heights.ravel() - heights)
    assert np.count_nonzero(heights > 0) > 2000
    assert np.count_nonzero(off > 1e-6) <= 3  # rays along the silhouette


def test_an_eye_beside_a_box_sees_its_wall_and_its_top_farther_away():
    eye = np.array([-0.2, 0.0, 0.8])
    seen = heights_from(BOX, eye, plane=0.0, cell=0.75e-3, margin=3e-3)
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
    seen = heights_from(BOX, None, plane=0.0, cell=0.75e-3, margin=6e-3)
    low, high = seen.bounds(3e-3)
    assert np.all(low <= seen.heights) and np.all(high >= seen.heights)
    grown = np.count_nonzero(high) * seen.cell**2
    assert grown == pytest.approx((0.06 + 6e-3) * (0.03 + 6e-3), rel=0.05)
    assert all(np.array_equal(bound, seen.heights) for bound in seen.bounds(0.0))


@pytest.mark.parametrize("turn", [0.0, 0.1, np.pi / 4])
def test_a_slit_wider_than_a_cell_stays_open(turn):
    cell, gap = 0.75e-3, 1.1e-3
    halves = [
        trimesh.creation.box((0.03, 0.03, 0.02), transform=translation([side * (0.03 + gap) / 2, 0, 0.01]))
        for side in (-1, 1)
    ]
    both = trimesh.util.concatenate(halves)
    assert isinstance(both, trimesh.Trimesh)
    both.apply_transform(trimesh.transformations.rotation_matrix(turn, [0, 0, 1]))
    seen = heights_from(surface_of(both), None, plane=0.0, cell=cell, margin=3e-3)
    low, _ = seen.bounds(cell)
    along = np.linspace(-0.012, 0.012, 25)
    x, y = -np.sin(turn) * along, np.cos(turn) * along
    column, row = (np.rint((v - c) / cell).astype(int) for v, c in zip((x, y), seen.corner, strict=True))
    assert np.all(low[row, column] == 0)


def test_a_padded_map_shows_the_table_around_the_part():
    seen = heights_from(BOX, None, plane=0.0, cell=0.75e-3, margin=1e-3)
    padded = seen.padded(3e-3)
    _, high = padded.bounds(3e-3)
    assert high[0].max() == high[-1].max() == high[:, 0].max() == high[:, -1].max() == 0
    inside = padded.heights[4:-4, 4:-4]
    assert np.array_equal(inside, seen.heights)
    assert padded.corner == pytest.approx(seen.corner - 4 * seen.cell)


def test_a_surface_is_turned_and_then_raised():
    moved = BOX.rotated(quat_about_z(np.asarray(np.pi / 2)), 0.005)
    assert np.ptp(moved.vertices, axis=0) == pytest.approx([0.03, 0.06, 0.02])
    assert moved.vertices[:, 2].min() == pytest.approx(0.005)


def test_faces_that_look_down_are_left_out_with_their_vertices():
    upper = surface_of(trimesh.creation.icosphere(radius=0.02)).facing(-0.3)
    a, b, c = np.moveaxis(upper.vertices[upper.faces], 1, 0)
    normals = np.cross(b - a, c - a)
    assert np.all(normals[:, 2] >= -0.3 * np.linalg.norm(normals, axis=1))
    assert -0.01 < upper.vertices[:, 2].min() < -0.005 and upper.vertices[:, 2].max() == pytest.approx(0.02)
    assert np.array_equal(np.unique(upper.faces), np.arange(len(upper.vertices)))
