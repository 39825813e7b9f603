"""Repairs are right, counted and reported; what is refused is refused for the true reason."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.bodies import repair_bodies
from mskgrasp.parts.solids.surface import Surface
from tests.parts.importing.surfaces import TORUS_VOLUME, box, grid, one, refusal, soup, torus


def test_equal_vertices_are_merged_and_the_torus_keeps_the_volume_of_the_formula():
    repaired = one(torus())
    assert repaired.notes == () and len(repaired.bodies) == 1
    # Inscribed in both circles: of 200 and of 100 sides.
    inscribed = (100 / np.pi * np.sin(np.pi / 100) * np.cos(np.pi / 100)) * (
        200 / np.pi * np.sin(np.pi / 200)
    )
    assert repaired.bodies[0].volume == pytest.approx(TORUS_VOLUME * inscribed, rel=2e-4)
    assert len(repaired.bodies[0].vertices) == 200 * 100 and repaired.bodies[0].is_watertight


def test_faces_wound_wrongly_are_turned_and_counted():
    surface = torus()
    faces = surface.faces.copy()
    chosen = np.random.default_rng(0).choice(len(faces), 300, replace=False)
    faces[chosen] = faces[chosen, ::-1]
    repaired = one(Surface(vertices=surface.vertices, faces=faces))
    assert repaired.notes == ("turned 300 faces outward",)
    assert repaired.bodies[0].volume == pytest.approx(TORUS_VOLUME, rel=2e-3)


def test_a_body_wound_inwards_is_turned_as_a_whole():
    repaired = one(box(40, 30, 20, inward=True))
    assert repaired.notes == ("turned 12 faces outward",)
    assert repaired.bodies[0].volume == pytest.approx(24_000)


def test_degenerate_and_repeated_faces_are_dropped_and_counted():
    cube = box(40, 30, 20)
    point, edge = cube.triangles[:1, [0, 0, 0]], cube.triangles[1:2, [0, 1, 1]]
    extra = np.concatenate([cube.triangles, point, edge, cube.triangles[3:5]])
    made = Surface(vertices=extra.reshape(-1, 3), faces=np.arange(3 * len(extra)).reshape(-1, 3))
    repaired = repair_bodies([made], bodies="one")
    assert repaired.notes == ("dropped 2 degenerate faces", "dropped 2 faces lying on another")
    assert repaired.bodies[0].volume == pytest.approx(24_000)


def test_a_body_drawn_from_both_sides_loses_the_inner_side():
    repaired = one(box(40, 30, 20), box(40, 30, 20, inward=True))
    assert repaired.notes[0] == "dropped 12 faces lying on another"
    assert repaired.bodies[0].volume == pytest.approx(24_000)


def both_sides(surface: Surface) -> Surface:
    return Surface(vertices=surface.vertices, faces=np.concatenate([surface.faces, surface.faces[:, ::-1]]))


@pytest.mark.parametrize("others", [1, 2])
def test_a_body_drawn_from_both_sides_stays_beside_others(others):
    beside = [box(30, 30, 20, at=(60 * n, 0, 0), inward=n == 2) for n in range(1, 1 + others)]
    repaired = repair_bodies([soup(both_sides(box(40, 30, 20)), *beside)], bodies="split")
    assert [body.volume for body in repaired.bodies] == pytest.approx([24_000] + others * [18_000])
    assert repaired.notes[0] == "dropped 12 faces lying on another"
    assert f"has {1 + others} separate bodies" in refusal(both_sides(box(40, 30, 20)), *beside)


def test_a_body_drawn_from_both_sides_stays_within_a_hollow_one():
    hollow = [box(100, 100, 100), box(80, 80, 80, inward=True)]
    repaired = repair_bodies([soup(*hollow, both_sides(box(40, 30, 20)))], bodies="split")
    assert [body.volume for body in repaired.bodies] == pytest.approx([1e6 - 512_000, 24_000])


def test_walls_between_bodies_that_fill_each_other_go():
    filled = one(box(100, 100, 100), box(80, 80, 80, inward=True), box(80, 80, 80))
    assert [body.volume for body in filled.bodies] == pytest.approx([1e6])
    # Six cubes around a seventh, mirrored at its sides so that the triangles on both sides coincide.
    middle = box(20, 20, 20)
    around = [
        Surface(vertices=middle.vertices * (1 - 2 * axis) + 20 * side * axis, faces=middle.faces[:, ::-1])
        for axis in np.eye(3)
        for side in (-1, 1)
    ]
    cross = one(middle, *around)
    assert cross.notes == ("dropped 24 faces lying on another",)
    assert [body.volume for body in cross.bodies] == pytest.approx([7 * 8000])


def test_a_fin_without_thickness_is_dropped_and_the_body_stays():
    fin = np.array([[20.0, -15.0, -10.0], [20.0, 15.0, 10.0], [50.0, 0.0, 0.0]])
    fins = Surface(vertices=np.concatenate([fin, fin[::-1]]), faces=np.arange(6).reshape(2, 3))
    repaired = one(box(40, 30, 20), fins)
    assert repaired.notes == ("dropped 2 faces lying on another",)
    assert np.allclose(repaired.bodies[0].extents, [40, 30, 20])


def test_faces_that_meet_within_a_micrometre_are_welded_and_wider_gaps_are_not():
    rng = np.random.default_rng(1)
    triangles = box(40, 30, 20).triangles
    shaken = Surface(
        vertices=(triangles + rng.uniform(-2e-4, 2e-4, triangles.shape)).reshape(-1, 3),
        faces=np.arange(36).reshape(-1, 3),
    )
    repaired = repair_bodies([shaken], bodies="one")
    assert repaired.notes == ("welded 28 vertices closer than 0.001 mm",)
    assert repaired.bodies[0].volume == pytest.approx(24_000, rel=1e-4)
    torn = Surface(
        vertices=(triangles + rng.uniform(-0.05, 0.05, triangles.shape)).reshape(-1, 3),
        faces=np.arange(36).reshape(-1, 3),
    )
    with pytest.raises(BadPart, match="is open: 36 edges"):
        repair_bodies([torn], bodies="one")


def test_an_open_surface_is_refused_with_its_open_edges_counted():
    cube = box(40, 30, 20)
    assert refusal(Surface(vertices=cube.vertices, faces=cube.faces[1:])).startswith("is open: 3 edges")


def test_a_sheet_without_thickness_is_called_a_sheet():
    corners = np.array([[0.0, 0, 0], [50, 0, 0], [0, 50, 0]])
    assert "is a flat sheet" in refusal(Surface(vertices=corners, faces=np.array([[0, 1, 2]])))
    assert "is a flat sheet" in refusal(Surface(vertices=corners, faces=np.array([[0, 1, 2], [2, 1, 0]])))
    dome = trimesh.creation.icosphere(2, 20)
    upper = np.asarray(dome.faces)[dome.triangles_center[:, 2] > 0]
    both = np.concatenate([upper, upper[:, ::-1]])
    assert "is a flat sheet" in refusal(Surface(vertices=np.asarray(dome.vertices), faces=both))


def test_a_one_sided_surface_is_refused():
    n, m = 60, 24
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    # The figure-8 Klein bottle; after one turn v comes back as -v.
    r = 30 + 10 * (np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v))
    z = 10 * (np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v))
    surface = grid(np.stack([r * np.cos(u), r * np.sin(u), z], axis=-1))
    faces = surface.faces.copy()
    seam = (faces.max(axis=1) >= (n - 1) * m) & (faces.min(axis=1) < m)
    back = np.where(faces < m, (-faces) % m, faces)
    faces[seam] = back[seam]
    with pytest.raises(BadPart, match="one-sided surface"):
        repair_bodies([Surface(vertices=surface.vertices, faces=faces)], bodies="one")
