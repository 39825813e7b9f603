"""Convex pieces of meshes that few hulls represent badly: close where possible, graded otherwise."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import store
from mskgrasp.parts.importing.import_file import import_part
from mskgrasp.parts.solids import mesh_pieces as mesh_pieces_module
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.layers import Tolerances
from mskgrasp.parts.solids.measure import MOST_ASPECT_RATIO, MOST_P95_MM, aspect_ratio, hull_fit
from mskgrasp.parts.solids.mesh_pieces import MOST_MESH_HULLS, MOST_OPENING_MM, mesh_pieces
from tests.parts.solids.test_decompose import mesh_of

DIGEST = """
import hashlib
from tests.parts.solids.test_mesh_pieces import honeycomb
from tests.parts.solids.test_decompose import mesh_of
from mskgrasp.parts.solids.mesh_pieces import mesh_pieces
print(hashlib.sha256(b"".join(p.tobytes() for p in mesh_pieces(mesh_of(honeycomb())))).hexdigest())
"""


def honeycomb() -> Manifold:
    body = s.extrude(s.rectangle(0, 40, 0, 30), 0, 6)
    for row in range(3):
        for column in range(3):
            body -= s.extrude(s.polygon(4.4, 6) + [7 + 12 * column, 6 + 9.5 * row], -1, 7)
    return body


def check(mesh: trimesh.Trimesh, pieces: tuple[np.ndarray, ...]) -> None:
    assert 1 <= len(pieces) <= MOST_MESH_HULLS
    for points in pieces:
        assert 4 <= len(points) <= s.MAX_HULL_VERTICES
        assert aspect_ratio(points) <= MOST_ASPECT_RATIO


def test_a_grille_that_few_pieces_of_coacd_do_not_represent_is_close_and_open():
    mesh = mesh_of(honeycomb())
    pieces = mesh_pieces(mesh)
    check(mesh, pieces)
    fit = hull_fit(mesh, pieces)
    assert fit.p95 < MOST_P95_MM and 1 / 1.1 < fit.volume_ratio < 1.1
    for points in pieces:
        assert not trimesh.convex.convex_hull(points).contains([[7, 6, 3], [19, 15.5, 3]]).any()


def plate(x: float, y: float, z: float, opening: Manifold) -> trimesh.Trimesh:
    return mesh_of(s.extrude(s.rectangle(0, x, 0, y), 0, z) - opening)


@pytest.mark.parametrize(
    "mesh",
    [
        plate(145, 125, 12, s.extrude(s.rectangle(56, 88, 50, 76), -1, 13)),  # 5 % of its volume
        plate(120, 90, 20, s.extrude(s.rectangle(45, 75, 33, 57), 8, 21)),
        plate(120, 80, 6, s.extrude(s.polygon(15, 40) + [60, 40], -1, 7)),
    ],
    ids=["window", "pocket", "bore"],
)
def test_an_opening_that_a_finger_enters_stays_open(mesh):
    pieces = mesh_pieces(mesh)
    check(mesh, pieces)
    middle = [*mesh.bounds.mean(axis=0)[:2], mesh.bounds[1, 2] - 1]
    assert not any(trimesh.convex.convex_hull(points).contains([middle])[0] for points in pieces)
    assert hull_fit(mesh, pieces).outward_largest <= MOST_OPENING_MM


def test_a_hole_that_no_finger_enters_is_filled():
    mesh = plate(60, 40, 8, s.extrude(s.polygon(2.5, 24) + [30, 20], -1, 9))
    assert len(mesh_pieces(mesh)) == 1


def test_a_thin_shell_keeps_its_inside_open():
    body = s.extrude(s.rectangle(0, 60, 0, 40), 0, 25) - s.extrude(s.rectangle(0.8, 59.2, 0.8, 39.2), 0.8, 26)
    mesh = mesh_of(body)
    pieces = mesh_pieces(mesh)
    check(mesh, pieces)
    assert hull_fit(mesh, pieces).p95 < 0.1
    assert not any(trimesh.convex.convex_hull(points).contains([[30, 20, 5]])[0] for points in pieces)


def test_a_ball_is_one_convex_body_and_its_pieces_are_close():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=15)
    pieces = mesh_pieces(mesh)
    check(mesh, pieces)
    assert hull_fit(mesh, pieces).p95 < MOST_P95_MM


def test_what_no_fine_layers_represent_becomes_as_close_as_coarse_ones_are(tmp_path, monkeypatch):
    # Rungs so coarse that the holes are filled, as for a mesh that finer ones would cut into too many pieces.
    coarse = Tolerances(sections=20, outline=2, thickness=5, holes=6)
    monkeypatch.setattr(mesh_pieces_module, "FINE", ())
    monkeypatch.setattr(mesh_pieces_module, "_WIDEST", coarse)
    monkeypatch.setattr(mesh_pieces_module, "COARSE", ())
    monkeypatch.setattr(mesh_pieces_module, "_FAR", np.inf)  # CoACD would find the holes
    mesh_of(honeycomb()).export(tmp_path / "grille.stl")
    with store.kept_in(tmp_path / "parts"):
        part = import_part(tmp_path / "grille.stl", density=1000.0)
    assert part.grade == "coarse" and part.n_hulls == 1
    holes = 9 * 4.4**2 * 1.5 * np.sqrt(3)
    # Mass is the mesh's, whatever the hulls are.
    assert part.mass == pytest.approx(1e-6 * 6 * (40 * 30 - holes), rel=1e-3)
    assert part.hull_volume_ratio == pytest.approx(40 * 30 / (40 * 30 - holes), rel=1e-3)


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.annulus(20, 40, 0.2, sections=64),
        trimesh.creation.annulus(15, 25, 0.2, sections=64),
        trimesh.creation.annulus(20, 40, 0.1, sections=64),
        mesh_of(s.extrude(np.array([(0, 0), (100, 0), (100, 60), (50, 60), (50, 20), (0, 20)]), 0, 0.15)),
        mesh_of(s.extrude(np.array([(0, 0), (100, 0), (100, 0.1), (0.1, 0.1), (0.1, 60), (0, 60)]), 0, 20)),
        trimesh.creation.box((100, 60, 0.01)),
    ],
    ids=["shim", "narrow shim", "foil ring", "sheet", "angle of foil", "foil"],
)
def test_what_is_too_thin_for_pieces_of_its_volume_is_refused(mesh):
    with pytest.raises(BadPart, match="too thin .* at least 0.2 mm: make it thicker"):
        mesh_pieces(mesh)


def test_a_shim_as_thick_as_slivers_are_not_has_the_pieces_of_its_volume():
    mesh = trimesh.creation.annulus(20, 40, 0.3, sections=64)
    pieces = mesh_pieces(mesh)
    check(mesh, pieces)
    assert hull_fit(mesh, pieces).volume_ratio == pytest.approx(1, abs=0.05)


def test_a_mesh_that_needs_too_many_pieces_is_refused(monkeypatch):
    monkeypatch.setattr(mesh_pieces_module, "MOST_MESH_HULLS", 1)
    with pytest.raises(BadPart, match="needs more than 128 convex pieces: simplify"):
        mesh_pieces(mesh_of(s.extrude(np.array([(0, 0), (60, 0), (60, 5), (5, 5), (5, 40), (0, 40)]), 0, 20)))


@pytest.mark.slow
def test_the_same_mesh_gives_the_same_bytes_in_another_process():
    here = hashlib.sha256(b"".join(p.tobytes() for p in mesh_pieces(mesh_of(honeycomb())))).hexdigest()
    there = subprocess.run(
        [sys.executable, "-c", DIGEST],
        env=os.environ | {"OMP_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert there.stdout.strip() == here
