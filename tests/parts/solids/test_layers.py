"""Layers of a mesh: exact for extrusions in any direction, steps elsewhere."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.layers import Layers, Tolerances, TurnedMesh, layer_directions
from mskgrasp.parts.solids.measure import hull_fit
from tests.parts.solids.test_decompose import angle_body, mesh_of

FINE = Tolerances(sections=0.4, outline=0.15, thickness=0.6, holes=0.5)


def pieces_of(
    mesh: trimesh.Trimesh, direction: np.ndarray, tolerances: Tolerances = FINE
) -> list[np.ndarray]:
    found = Layers(TurnedMesh(mesh, np.asarray(direction, dtype=float)), tolerances).pieces()
    assert found is not None
    return found


def volume(pieces: list[np.ndarray]) -> float:
    return sum(ConvexHull(points).volume for points in pieces)


def test_an_extrusion_is_exact_along_its_direction_wherever_that_points():
    mesh = mesh_of(angle_body())
    turn = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))
    turned = mesh.copy().apply_transform(turn)
    direction = np.asarray(turn)[:3, 2]
    for body, along in ((mesh, np.array([0, 0, 1.0])), (turned, direction)):
        pieces = pieces_of(body, along)
        assert len(pieces) == 2
        assert volume(pieces) == pytest.approx(body.volume, rel=1e-6)
        assert hull_fit(body, pieces).largest < 0.01
    assert any(abs(found @ direction) > 1 - 1e-9 for found in layer_directions(turned))


def test_steps_and_pockets_with_islands_are_layers_of_their_own():
    tub = s.extrude(s.rectangle(0, 40, 0, 30), 0, 12) - s.extrude(s.rectangle(3, 37, 3, 27), 4, 13)
    mesh = mesh_of(tub + s.extrude(s.rectangle(15, 25, 10, 20), 3, 9))
    pieces = pieces_of(mesh, np.array([0, 0, 1]))
    assert volume(pieces) == pytest.approx(mesh.volume, rel=1e-6)
    assert {round(float(z), 6) for points in pieces for z in points[:, 2]} == {0, 4, 9, 12}


def test_a_cone_becomes_steps_within_the_tolerance():
    mesh = trimesh.creation.cone(15, 30, sections=64)
    pieces = pieces_of(mesh, np.array([0, 0, 1]))
    fit = hull_fit(mesh, pieces)
    assert fit.p95 < FINE.sections and len(pieces) > 20


def test_small_holes_are_filled_where_the_tolerance_says_so():
    plate = s.extrude(s.rectangle(0, 40, 0, 30), 0, 5) - s.drill(2.0, (20, 15, -1), "z", 7)
    filled = pieces_of(mesh_of(plate), np.array([0, 0, 1]), Tolerances(**(vars(FINE) | {"holes": 2.6})))
    assert len(filled) == 1 and volume(filled) == pytest.approx(40 * 30 * 5)
    assert len(pieces_of(mesh_of(plate), np.array([0, 0, 1]))) > 3


def test_the_direction_of_the_extrusion_has_the_fewest_pieces_by_estimate_and_in_fact():
    mesh = mesh_of(angle_body() - s.drill(4, (30, -1, 15), "y", 10))
    counts = {tuple(d): Layers(TurnedMesh(mesh, d), FINE) for d in layer_directions(mesh)}
    best = min(counts, key=lambda d: counts[d].count)
    numbers = {d: len(layers.pieces() or ()) for d, layers in counts.items()}
    assert numbers[best] == min(numbers.values())
