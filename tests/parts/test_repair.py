"""Repairs are right, counted and reported; what is refused is refused for the true reason."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.bodies import RepairedBodies, repair_bodies
from mskgrasp.parts.importing.winding import miscounted_fraction, winding_number
from mskgrasp.parts.solids.surface import Surface


def box(*size: float, at=(0.0, 0.0, 0.0), inward: bool = False) -> Surface:
    mesh = trimesh.creation.box(size)
    faces = np.asarray(mesh.faces)[:, ::-1] if inward else np.asarray(mesh.faces)
    return Surface(vertices=np.asarray(mesh.vertices) + at, faces=faces)


def soup(*surfaces: Surface) -> Surface:
    """As an STL holds them: every face with corners of its own."""
    triangles = np.concatenate([surface.triangles for surface in surfaces])
    return Surface(vertices=triangles.reshape(-1, 3), faces=np.arange(3 * len(triangles)).reshape(-1, 3))


def grid(points: np.ndarray) -> Surface:
    """A closed surface of a grid (n, m, 3) that joins itself at all four borders."""
    n, m = points.shape[:2]
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Surface(vertices=points.reshape(-1, 3), faces=faces)


def torus(n: int = 200, m: int = 100, wide: float = 30.0, thick: float = 10.0) -> Surface:
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    radius = wide + thick * np.cos(v)
    return grid(np.stack([radius * np.cos(u), radius * np.sin(u), thick * np.sin(v)], axis=-1))


def one(*surfaces: Surface) -> RepairedBodies:
    return repair_bodies([soup(*surfaces)], bodies="one")


def refusal(*surfaces: Surface, bodies="one") -> str:
    with pytest.raises(BadPart) as caught:
        repair_bodies([soup(*surfaces)], bodies=bodies)
    assert "\n" not in str(caught.value)
    return str(caught.value)


TORUS_VOLUME = 2 * np.pi**2 * 30 * 10**2


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


def test_a_cavity_stays_a_cavity_whichever_way_the_file_was_wound():
    for inner, outer, turned in ((True, False, ()), (False, True, ("turned 24 faces outward",))):
        repaired = one(box(40, 30, 20, inward=outer), box(10, 10, 10, inward=inner))
        assert len(repaired.bodies) == 1 and repaired.notes == turned
        assert repaired.bodies[0].volume == pytest.approx(23_000)


def test_a_body_inside_another_is_a_second_body_and_union_swallows_it():
    assert "has 2 separate bodies (24, 1 cm^3): --split" in refusal(box(40, 30, 20), box(10, 10, 10))
    joined = repair_bodies([soup(box(40, 30, 20), box(10, 10, 10))], bodies="union")
    assert joined.bodies[0].volume == pytest.approx(24_000)
    assert joined.notes == ("joined 2 bodies into one",)


def test_a_ball_loose_in_a_cavity_is_a_body_and_the_cavity_stays_with_its_host():
    parts = (box(40, 30, 20), box(16, 16, 16, inward=True), box(4, 4, 4))
    split = repair_bodies([soup(*parts)], bodies="split")
    assert [body.volume for body in split.bodies] == pytest.approx([24_000 - 4096, 64])
    assert "do not touch even when joined" in refusal(*parts, bodies="union")


def test_split_makes_bodies_by_decreasing_volume_and_union_joins_what_overlaps_or_touches():
    small, large = box(10, 10, 10, at=(100, 0, 0)), box(40, 30, 20)
    split = repair_bodies([soup(small, large)], bodies="split")
    assert [body.volume for body in split.bodies] == pytest.approx([24_000, 1000])
    assert split.notes == ("split into 2 parts",)
    overlapping = repair_bodies([soup(large, box(40, 30, 20, at=(20, 15, 10)))], bodies="union")
    assert overlapping.bodies[0].volume == pytest.approx(48_000 - 20 * 15 * 10)
    touching = repair_bodies([soup(large, box(40, 30, 20, at=(40, 5, 0)))], bodies="union")
    assert len(touching.bodies) == 1 and touching.bodies[0].volume == pytest.approx(48_000)
    assert "has 2 bodies that do not touch even when joined" in refusal(small, large, bodies="union")
    assert (
        repair_bodies([soup(large)], bodies="union").notes
        == ()
        == repair_bodies([soup(large)], bodies="split").notes
    )


def test_bodies_that_touch_along_an_edge_or_a_face_are_told_apart():
    for shift in ((40, 30, 0), (40, 5, 0), (40, 0, 0), (40, 30, 20)):
        split = repair_bodies([soup(box(40, 30, 20), box(40, 30, 20, at=shift))], bodies="split")
        if shift != (40, 0, 0):  # there both faces are drawn by the same triangles or by crossed ones
            assert [body.volume for body in split.bodies] == pytest.approx([24_000, 24_000])
        assert sum(body.volume for body in split.bodies) == pytest.approx(48_000)


def test_objects_that_are_closed_by_themselves_are_bodies_and_open_ones_are_taken_together():
    two = repair_bodies([box(40, 30, 20), box(40, 30, 20, at=(40, 0, 0))], bodies="split")
    assert len(two.bodies) == 2
    cube = box(40, 30, 20)
    coloured = [Surface(vertices=cube.vertices, faces=faces) for faces in np.split(cube.faces, 6)]
    assert repair_bodies(coloured, bodies="one").bodies[0].volume == pytest.approx(24_000)


def test_a_thousand_loose_bodies_are_no_part():
    shifts = np.stack(np.meshgrid(*3 * [np.arange(0, 40, 4.0)]), axis=-1).reshape(-1, 3)
    assert "has 1,000 separate bodies" in refusal(
        *(box(1, 1, 1, at=shift) for shift in shifts), bodies="split"
    )


def extruded(outline: np.ndarray, height: float) -> Surface:
    """A prism with any outline (n, 2), also one that crosses itself; its ends are fans about the origin."""
    n = len(outline)
    ends = [np.column_stack([np.vstack([outline, np.zeros(2)]), np.full(n + 1, z)]) for z in (0.0, height)]
    i = np.arange(n)
    j, centre, up = (i + 1) % n, np.full(n, n), n + 1
    faces = [(centre, j, i), (centre + up, i + up, j + up), (i, j, j + up), (i, j + up, i + up)]
    return Surface(
        vertices=np.concatenate(ends), faces=np.concatenate([np.stack(face, axis=1) for face in faces])
    )


def pentagram() -> Surface:
    """A star drawn in one stroke: its middle lies inside twice."""
    angle = np.pi / 2 + 4 * np.pi / 5 * np.arange(5)
    return extruded(30 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 10.0)


def test_volume_counted_twice_is_measured_as_the_formula_says_and_refused():
    star = pentagram()
    stroke = 5 / 2 * 30**2 * np.sin(4 * np.pi / 5)
    middle = 5 / 2 * (30 * (3 - np.sqrt(5)) / 2) ** 2 * np.sin(2 * np.pi / 5)
    assert star.volume == pytest.approx(10 * stroke)
    assert miscounted_fraction(star.triangles) == pytest.approx(middle / (stroke - middle), rel=0.02)
    assert refusal(star).startswith("crosses itself: ")
    assert winding_number(star.triangles, np.array([0.1, 0.2, 5.0])) == pytest.approx(2)


@pytest.mark.parametrize("surface", [box(40, 30, 20), torus(), box(100, 60, 1)])
def test_a_surface_that_does_not_cross_itself_has_nothing_counted_twice(surface):
    assert miscounted_fraction(surface.triangles) == 0
    assert winding_number(surface.triangles, surface.vertices.max(axis=0) + 1) == pytest.approx(0, abs=1e-9)


def ring_with_lap(lap: float) -> Surface:
    """A flat ring of radii 10 and 20 mm, drawn round from 0 to 2 pi + lap: its ends lie in each other."""
    n = 100
    angle = np.linspace(0, 2 * np.pi + lap, n)
    section = np.array([[10.0, 0.0], [20.0, 0.0], [20.0, 5.0], [10.0, 5.0]])
    points = np.stack(
        [section[:, 0] * np.cos(angle)[:, None], section[:, 0] * np.sin(angle)[:, None],
         np.broadcast_to(section[:, 1], (n, 4))], axis=-1
    )  # fmt: skip
    sides = grid(points).faces
    sides = sides[
        sides.max(axis=1) - sides.min(axis=1) < 4 * (n - 2)
    ]  # not from the last section to the first
    ends = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])
    ends[2:] += 4 * (n - 1)
    return Surface(vertices=points.reshape(-1, 3), faces=np.concatenate([sides, ends[:, ::-1]]))


def test_a_crossing_too_small_to_matter_is_kept_and_told():
    share = 0.01 / (2 * np.pi)
    ring = ring_with_lap(0.01)
    assert abs(ring.volume) == pytest.approx(5 * np.pi * 300 * (1 + share), rel=2e-3)
    told = one(ring).notes
    assert told[-1].startswith("crosses itself in ") and told[-1].endswith(" % of its volume (kept)")
    assert 50 * share < float(told[-1].split()[3]) < 200 * share
    with pytest.raises(BadPart, match="crosses itself"):
        one(ring_with_lap(0.1))


def test_faces_folded_over_their_neighbours_are_refused_for_booleans_would_not_keep_the_volume():
    # The ends are fans about a point from which the notch hides a part of the rim.
    outline = np.array([(0, 0), (40, 0), (40, 40), (22, 40), (20, 5), (18, 40), (0, 40)], dtype=float)
    folded = extruded(outline - (7, 13), 10.0)
    assert folded.volume == pytest.approx(15_300)
    assert "folded" in refusal(folded)


def test_a_fine_mesh_is_decimated_within_the_reported_distance():
    fine = torus(600, 200)
    repaired = one(fine)
    thin = repaired.bodies[0]
    assert len(thin.faces) < 50_000 and thin.is_watertight
    assert repaired.notes[0].startswith("decimated from 240,000 to ")
    said = float(repaired.notes[0].split("at most ")[1].split()[0])
    # The torus knows how far a point is from its surface; its own facets are 0.01 mm inside it.
    points = np.concatenate([thin.vertices, thin.triangles_center])
    true = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 30, points[:, 2]) - 10
    assert 0 < said <= 0.05 and np.abs(true).max() < said + 0.02
    assert thin.volume == pytest.approx(TORUS_VOLUME, rel=2e-3)


def test_a_mesh_too_rough_to_be_decimated_is_refused():
    rough = torus(700, 160)
    rng = np.random.default_rng(2)
    noise = rng.uniform(-0.3, 0.3, rough.vertices.shape)
    with pytest.raises(BadPart, match="the most is 200,000"):
        one(Surface(vertices=rough.vertices + noise * 0.2, faces=rough.faces))
