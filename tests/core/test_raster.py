import numpy as np
import pytest
import trimesh

from mskgrasp.core.raster import raise_cells


def drawn(vertices: np.ndarray, faces: np.ndarray, shape: tuple[int, int], least: float) -> np.ndarray:
    cells = np.full(shape, least)
    x, y, values = np.ascontiguousarray(vertices.T)
    raise_cells(cells, x, y, values, faces)
    return cells


def test_values_on_a_triangle_are_linear_and_those_beside_it_stay():
    corners = np.array([[1.0, 1.0, 0.0], [9.0, 2.0, 0.0], [3.0, 8.0, 0.0]])
    corners[:, 2] = 5 + corners[:, 0] - 0.5 * corners[:, 1]
    cells = drawn(corners, np.array([[0, 1, 2]]), (10, 11), -1.0)
    row, column = np.mgrid[:10, :11]
    inside = cells > -1
    assert np.allclose(cells[inside], (5 + column - 0.5 * row)[inside])
    middles = np.column_stack([column.ravel(), row.ravel(), np.zeros(row.size)])
    flat = corners * [1, 1, 0]
    shares = trimesh.triangles.points_to_barycentric(np.repeat(flat[None], len(middles), axis=0), middles)
    assert np.array_equal(inside.ravel(), (shares > -1e-9).all(axis=1))


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_the_order_of_a_triangle_s_vertices_does_not_matter(order):
    corners = np.array([[0.3, 0.2, 1.0], [6.7, 3.1, 2.0], [2.2, 7.9, 3.0]])
    first = drawn(corners, np.array([[0, 1, 2]]), (9, 9), 0.0)
    assert np.allclose(drawn(corners, np.array([order]), (9, 9), 0.0), first)


def test_a_closed_surface_has_no_gaps_at_any_turn():
    sphere = trimesh.creation.icosphere(subdivisions=3)
    rng = np.random.default_rng(0)
    for turn in trimesh.transformations.random_rotation_matrix(rng.random(3)), np.eye(4):
        vertices = trimesh.transform_points(sphere.vertices, turn) * 20 + [25, 25, 0]
        cells = drawn(vertices, sphere.faces, (51, 51), -np.inf)
        row, column = np.mgrid[:51, :51]
        far = np.hypot(row - 25, column - 25)
        height = np.sqrt(np.maximum(20**2 - far**2, 0))
        assert np.abs(cells - height)[far < 17].max() < 0.2
        assert np.all(cells[far > 20] == -np.inf)


def test_of_several_triangles_over_a_cell_the_highest_value_stays():
    square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    vertices = np.vstack([np.column_stack([square, np.full(4, height)]) for height in (3.0, 7.0, 5.0)])
    faces = np.vstack([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * i for i in range(3)])
    assert np.all(drawn(vertices, faces, (5, 5), 0.0) == 7.0)
    assert np.all(drawn(vertices, faces, (5, 5), 8.0) == 8.0)


def test_what_lies_outside_the_grid_is_left_out():
    vertices = np.array(
        [[-50.0, -50, 1], [60, -40, 1], [5, 70, 1], [100, 100, 2], [120, 100, 2], [110, 130, 2]]
    )
    assert np.all(drawn(vertices, np.array([[0, 1, 2], [3, 4, 5]]), (6, 6), 0.0) == 1.0)


def test_triangles_seen_edge_on_raise_nothing_above_their_edge():
    wall = np.array([[1.0, 2.0, 0.0], [6.0, 2.0, 0.0], [3.0, 2.0, 9.0]])
    cells = drawn(wall, np.array([[0, 1, 2]]), (5, 8), 0.0)
    assert cells.max() <= 9.0 and np.all(cells[[0, 1, 3, 4]] == 0.0)


def test_random_triangles_are_drawn_as_barycentric_coordinates_say():
    rng = np.random.default_rng(1)
    row, column = np.mgrid[:20, :25]
    for _ in range(200):
        corners = np.column_stack([rng.uniform(-4, 28, (3, 2)), rng.uniform(1, 9, 3)])
        if rng.random() < 0.3:
            corners[1, 1] = corners[0, 1] + rng.uniform(0, 0.05)  # a nearly flat edge
        cells = drawn(corners, np.array([[0, 1, 2]]), (20, 25), 0.0)
        a, b, c = corners
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        u = ((b[0] - column) * (c[1] - row) - (b[1] - row) * (c[0] - column)) / area
        v = ((c[0] - column) * (a[1] - row) - (c[1] - row) * (a[0] - column)) / area
        least = np.minimum(np.minimum(u, v), 1 - u - v)
        value = u * a[2] + v * b[2] + (1 - u - v) * c[2]
        assert np.allclose(cells[least > 1e-6], value[least > 1e-6], atol=1e-6)
        assert np.all(cells[least < -1e-6] == 0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 1])
def test_triangles_that_are_not_finite_are_left_out(bad, axis):
    vertices = np.array([[0.0, 0, 1], [9, 0, 1], [0, 9, 1], [2, 2, 5]])
    vertices[3, axis] = bad
    cells = drawn(vertices, np.array([[0, 3, 2], [0, 1, 2]]), (10, 10), 0.0)
    assert cells.max() == 1.0 and cells[0, 0] == 1.0


@pytest.mark.parametrize("far", [1e9, 9.3e18, 1e300])
def test_triangles_that_reach_far_beyond_the_grid_are_clipped(far):
    vertices = np.array([[-far, -far, 1], [far, -far, 1], [0, far, 1]])
    assert np.all(drawn(vertices, np.array([[0, 1, 2]]), (6, 6), 0.0) == 1.0)
    assert np.all(drawn(vertices + [3 * far, 0, 0], np.array([[0, 1, 2]]), (6, 6), 0.0) == 0.0)
