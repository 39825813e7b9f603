"""Shapes and their convex pieces: what is cut, turned and joined stays exact, and PhysX can take it."""

import math

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from mskgrasp.parts.solids import solid as s
from mskgrasp.parts.solids.shape import Shape, block, convex, cylinder, hexagon_bar, plate, swept, turned


def union_volume(shape: Shape) -> float:
    bodies = [Manifold.hull_points(np.asarray(points, dtype=np.float64)) for points in shape.hulls]
    return Manifold.batch_boolean(bodies, OpType.Add).volume()


def test_blocks_add_and_subtract_exactly():
    bracket = block(0, 60, 0, 30, 0, 5) + block(0, 5, 0, 30, 0, 50) - block(20, 40, 10, 20, -1, 6)
    volume = 60 * 30 * 5 + 5 * 30 * 45 - 20 * 10 * 5
    assert bracket.body.volume() == pytest.approx(volume)
    assert union_volume(bracket) == pytest.approx(volume)
    assert len(bracket.solid().hulls) <= 5


def test_a_bored_block_keeps_its_bore_open_in_the_hulls():
    bored = block(-20, 20, -20, 20, 0, 30) - cylinder(10, -1, 31)
    probe = Manifold.hull_points(s.prism(s.polygon(9.5, 64), 1, 29))
    for points in bored.hulls:
        assert (Manifold.hull_points(points) ^ probe).volume() < 0.02 * probe.volume()
    assert bored.body.volume() == pytest.approx(40 * 40 * 30 - math.pi * 100 * 30, rel=1e-3)


def test_drilled_holes_are_in_the_body_alone():
    drilled = block(0, 40, 0, 40, 0, 10).drilled(cylinder(3, -1, 11).moved(20, 20, 0))
    assert drilled.body.volume() == pytest.approx(16000 - math.pi * 9 * 10, rel=1e-3)
    assert union_volume(drilled) == pytest.approx(16000)


def test_turned_tubes_and_shafts_have_the_volume_of_their_cylinders():
    shaft = turned([(0, 0), (10, 0), (10, 25), (14, 25), (14, 65), (0, 65)])
    exact = math.pi * (100 * 25 + 196 * 40)
    assert shaft.body.volume() == pytest.approx(exact, rel=1e-3)
    assert union_volume(shaft) == pytest.approx(exact, rel=0.01)
    tube = turned([(10, 0), (13, 0), (13, 30), (10, 30)])
    assert union_volume(tube) == pytest.approx(math.pi * (169 - 100) * 30, rel=0.02)


def test_a_flange_hides_its_chords_in_the_tube():
    flanged = turned([(10, 0), (20, 0), (20, 4), (13, 4), (13, 30), (10, 30)])
    bore = Manifold.hull_points(s.prism(s.polygon(9.5, 64), 0.5, 29.5))
    assert all((Manifold.hull_points(points) ^ bore).is_empty() for points in flanged.hulls)
    assert len(flanged.hulls) <= 20


def test_turning_and_moving_take_body_and_hulls_along():
    bar = block(0, 40, -5, 5, 0, 10).turned("y", -90).moved(1, 2, 3)
    low, high = np.array(bar.body.bounding_box()).reshape(2, 3)
    points = np.concatenate(bar.hulls)
    assert np.allclose(low, [-9, -3, 3]) and np.allclose(high, [1, 7, 43])
    assert np.allclose(points.min(axis=0), low) and np.allclose(points.max(axis=0), high)
    mirrored = bar.mirrored("x")
    assert mirrored.body.volume() == pytest.approx(4000)
    assert np.allclose(np.concatenate(mirrored.hulls)[:, 0], -points[:, 0])


def test_a_hexagon_has_its_flats_where_it_says():
    nut = hexagon_bar(30, 0, 20)
    assert np.ptp(np.concatenate(nut.hulls)[:, 1]) == pytest.approx(30)
    assert nut.body.volume() == pytest.approx(math.sqrt(3) / 2 * 900 * 20)


def test_a_swept_bend_is_as_long_as_its_arc():
    angles = np.radians(np.arange(0, 91, 7.5))
    ring = np.array([[-2.0, -2], [2, -2], [2, 2], [-2, 2]])
    sections = [
        np.column_stack([(30 + ring[:, 0]) * np.cos(a), (30 + ring[:, 0]) * np.sin(a), ring[:, 1]])
        for a in angles
    ]
    bend = swept(sections)
    assert len(bend.hulls) == 12
    assert bend.body.volume() == pytest.approx(16 * 30 * math.pi / 2, rel=0.005)


def test_pieces_that_are_convex_together_become_one():
    halves = block(0, 10, 0, 10, 0, 10) + block(10, 30, 0, 10, 0, 10) + block(30, 40, 0, 10, 0, 20)
    assert sorted(len(points) for points in halves.solid().hulls) == [8, 8]


def test_slivers_are_left_out():
    thin = convex(np.array(block(0, 10, 0, 10, 0, 0.02).hulls[0]))
    assert len((block(0, 10, 0, 10, 0, 10) + thin).solid().hulls) == 1


def test_a_plate_fills_small_holes_and_keeps_large_ones():
    kept = plate(s.rectangle(0, 80, 0, 40), 0, 6, [(10, 10, 2), (50, 20, 12)])
    assert kept.body.volume() == pytest.approx(6 * (3200 - math.pi * (4 + 144)), rel=1e-3)
    assert union_volume(kept) == pytest.approx(6 * (3200 - math.pi * 144), rel=0.01)
    assert all(len(points) <= 32 for points in kept.hulls)
