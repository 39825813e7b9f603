"""Convex pieces of any mesh: within the bounds, few, and the same every time."""

import hashlib
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.solids import decompose
from mskgrasp.parts.solids import shape as h
from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.decompose import MOST_HULLS, convex_pieces, fewest_hulls
from mskgrasp.parts.solids.measure import MeshSurface, hull_fit

DIGEST = """
import hashlib
from tests.parts.solids.test_decompose import angle_body, mesh_of
from mskgrasp.parts.solids.decompose import convex_pieces
print(hashlib.sha256(b"".join(p.tobytes() for p in convex_pieces(mesh_of(angle_body())))).hexdigest())
"""


def mesh_of(body: Manifold) -> trimesh.Trimesh:
    return s.solid(body, []).mesh


def angle_body() -> Manifold:
    return s.extrude(np.array([[0, 0], [50, 0], [50, 8], [8, 8], [8, 40], [0, 40]], dtype=float), 0, 30)


def tee() -> h.Shape:
    tube = h.turned([(10, -35), (14, -35), (14, 35), (10, 35)]).turned("y", 90)
    branch = h.turned([(10, 0), (14, 0), (14, 35), (10, 35)])
    bore = h.cylinder(10, -36, 36)
    return (tube - h.cylinder(10, 0, 20)) + (branch - bore.turned("y", 90))


def test_a_box_is_one_piece_with_its_own_corners():
    mesh = trimesh.creation.box((40, 30, 20))
    (piece,) = convex_pieces(mesh)
    assert sorted(map(tuple, piece)) == sorted(map(tuple, mesh.vertices))


def test_an_angle_becomes_two_boxes_without_error():
    mesh = mesh_of(angle_body())
    pieces = convex_pieces(mesh)
    assert len(pieces) == 2
    fit = hull_fit(mesh, pieces)
    assert fit.largest < 0.1
    assert fit.volume_ratio == pytest.approx(1, abs=0.002)


def test_a_ring_keeps_its_hole_and_the_bounds():
    mesh = trimesh.creation.annulus(15, 25, 12, sections=24)
    pieces = convex_pieces(mesh)
    fit = hull_fit(mesh, pieces)
    assert fit.p95 <= 0.7
    assert 1 / 1.1 <= fit.volume_ratio <= 1.1
    assert len(pieces) <= MOST_HULLS
    assert max(map(len, pieces)) <= 32
    for points in pieces:
        hull = trimesh.convex.convex_hull(points)
        assert not hull.contains([[0, 0, 0]])[0]


def test_a_round_bar_keeps_its_ends_though_it_has_few_corners():
    mesh = trimesh.creation.cylinder(8, 90, sections=96)
    (piece,) = convex_pieces(mesh)
    assert len(piece) <= 32
    assert np.ptp(piece[:, 2]) == pytest.approx(90, abs=1e-6)
    assert hull_fit(mesh, [piece]).largest < 0.5


def test_errors_each_way_tell_a_filled_notch_from_a_missing_lug():
    # From the mesh, the bottom of a filled notch is 10 mm from the hulls; so is the top of a missing lug.
    bar = s.extrude(s.rectangle(0, 60, 0, 20), 0, 20)
    notched = bar - s.extrude(s.rectangle(28, 32, 10, 21), -1, 21)
    fit = hull_fit(mesh_of(notched), [s.box(0, 60, 0, 20, 0, 20)])
    assert fit.outward_largest < fit.inward_largest == fit.largest
    assert fit.inward_largest == pytest.approx(10, abs=0.6)
    lugged = bar + s.extrude(s.rectangle(28, 32, 19, 30), 0, 20)
    fit = hull_fit(mesh_of(lugged), [s.box(0, 60, 0, 20, 0, 20)])
    assert fit.inward_largest == pytest.approx(10, abs=0.6)
    assert fit.volume_ratio < 1
    assert max(fit.inward_p95, fit.outward_p95) >= fit.p95 >= min(fit.inward_p95, fit.outward_p95)


def test_what_no_pieces_stand_for_is_refused_with_both_numbers(monkeypatch):
    # One rung so coarse that the angle is left as one hull: that adds the triangle between the legs.
    monkeypatch.setattr(decompose, "CONCAVITIES_MM", (60.0,))
    hull_area, area = 50 * 8 + 32 * 8 + 42 * 32 / 2, 50 * 8 + 32 * 8
    ratio = f"{hull_area / area:.2f}"
    with pytest.raises(
        BadPart, match=rf"within [\d.]+ mm \(at most 0.7 mm\), volume ratio {ratio} .*simplify"
    ):
        convex_pieces(mesh_of(angle_body()))


@pytest.mark.slow
def test_the_same_mesh_gives_the_same_bytes_in_any_process_with_any_threads():
    pieces = convex_pieces(mesh_of(angle_body()))
    here = hashlib.sha256(b"".join(p.tobytes() for p in pieces)).hexdigest()
    for threads in ("1", "2"):
        environment = os.environ | {"OMP_NUM_THREADS": threads}
        there = subprocess.run(
            [sys.executable, "-c", DIGEST], env=environment, capture_output=True, text=True, check=True
        )
        assert there.stdout.strip() == here


@pytest.mark.slow
def test_exact_pieces_of_a_tee_are_joined_within_the_closer_bound():
    exact = tee().solid()
    joined = fewest_hulls(exact.mesh, exact.hulls)
    assert len(joined) <= 38 < len(exact.hulls)
    fit = hull_fit(exact.mesh, joined)
    assert fit.p95 <= 0.35
    assert 1 / 1.05 <= fit.volume_ratio <= 1.05
    again = fewest_hulls(exact.mesh, exact.hulls)
    assert all(np.array_equal(a, b) for a, b in zip(joined, again, strict=True))


def test_a_ball_is_cut_up_until_few_corners_are_round_enough():
    ball = trimesh.creation.icosphere(4, 20)
    with_one_hull = hull_fit(ball, [s.few_corners(ball.vertices)])
    assert with_one_hull.p95 > 0.7
    pieces = convex_pieces(ball)
    assert len(pieces) <= 12
    assert max(map(len, pieces)) <= 32
    assert hull_fit(ball, pieces).p95 <= 0.7


def test_a_sliver_is_taken_up_by_its_neighbour_instead_of_being_cut_to_pieces():
    boxes = [
        trimesh.creation.box(bounds=[[x0, 0, 0], [x1, 30, 20]])
        for x0, x1 in ((0, 29.7), (29.7, 30), (30, 60))
    ]
    pieces = [np.asarray(box.vertices) for box in boxes]
    mesh = trimesh.creation.box(bounds=[[0, 0, 0], [60, 30, 20]])
    assert len(decompose.split_slender(pieces)) > 3
    assert len(decompose._join(MeshSurface(mesh), pieces, 0.7, 1.1, finish=decompose.split_slender)) == 1


@pytest.mark.slow
def test_a_fit_that_stops_early_decides_as_the_whole_fit_does():
    mesh = mesh_of(angle_body())
    surface = MeshSurface(mesh)
    for pieces in (convex_pieces(mesh), [np.asarray(mesh.vertices)], [s.box(0, 50, 0, 8.5, 0, 30)]):
        whole = surface.fit(pieces)
        assert surface.outward_largest(pieces) == whole.outward_largest
        for most_p95 in (whole.p95 - 1e-6, whole.p95 + 1e-6):
            for most_ratio in (1.05, 4.0):
                for most_outward in (whole.outward_largest - 1e-6, whole.outward_largest + 1e-6):
                    found = surface.fit_within(pieces, most_p95, most_ratio, most_outward)
                    kept = (
                        whole.p95 <= most_p95
                        and 1 / most_ratio <= whole.volume_ratio <= most_ratio
                        and whole.outward_largest <= most_outward
                    )
                    assert found == (whole if kept else None)


@pytest.mark.slow
def test_coacd_ends_with_the_process_that_waits_for_it():
    code = """
import trimesh
from mskgrasp.parts.solids.decompose import cut_up
mesh = trimesh.creation.torus(30, 10, major_sections=120, minor_sections=60)
print("cutting", flush=True)
cut_up(mesh, 0.05)
"""
    deadline = time.monotonic() + 60
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as waiting:
        assert waiting.stdout is not None and waiting.stdout.readline() == b"cutting\n"
        children = Path(f"/proc/{waiting.pid}/task/{waiting.pid}/children")
        while not (found := children.read_text().split()) and time.monotonic() < deadline:
            time.sleep(0.05)
        (child,) = found
        time.sleep(3.0)  # until it has asked the system to be ended
        waiting.kill()
    while Path(f"/proc/{child}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{child}").exists()


def test_coacd_that_cannot_be_run_is_no_fault_of_the_mesh(monkeypatch):
    monkeypatch.setattr(decompose, "_PROGRAM", "import no_such_module")
    with pytest.raises(RuntimeError, match="CoACD cannot be run: .*no_such_module"):
        decompose.cut_up(trimesh.creation.box((10, 10, 10)), 1.0)


def test_a_mesh_on_which_coacd_is_killed_asks_for_memory(monkeypatch):
    monkeypatch.setattr(decompose, "_PROGRAM", "import os; os.kill(os.getpid(), 9)")
    with pytest.raises(BadPart, match="was killed: free memory"):
        decompose.cut_up(trimesh.creation.box((10, 10, 10)), 1.0)
