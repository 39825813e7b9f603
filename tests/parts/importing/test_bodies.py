"""Bodies of files: cavities, several bodies, surfaces that cross themselves."""

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.bodies import repair_bodies
from mskgrasp.parts.solids.surface import Surface
from tests.parts.importing.surfaces import box, grid, one, refusal, soup


def test_a_cavity_stays_a_cavity_whichever_way_the_file_was_wound():
    for inner, outer, turned in ((True, False, ()), (False, True, ("turned 24 faces outward",))):
        repaired = one(box(40, 30, 20, inward=outer), box(10, 10, 10, inward=inner))
        assert len(repaired.bodies) == 1 and repaired.notes == turned
        assert repaired.bodies[0].volume == pytest.approx(23_000)


def test_a_body_inside_another_is_a_second_body_and_union_swallows_it():
    assert "has 2 separate bodies (24, 1 cm^3): mskgrasp.parts import --split" in refusal(
        box(40, 30, 20), box(10, 10, 10)
    )
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


def test_bodies_that_touch_along_an_edge_and_along_a_face_are_distinguished():
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


def test_a_crossing_too_small_to_matter_is_kept_and_reported():
    share = 0.01 / (2 * np.pi)
    ring = ring_with_lap(0.01)
    assert abs(ring.volume) == pytest.approx(5 * np.pi * 300 * (1 + share), rel=2e-3)
    notes = one(ring).notes
    assert notes[-1].startswith("crosses itself in ") and notes[-1].endswith(" % of its volume (kept)")
    assert 50 * share < float(notes[-1].split()[3]) < 200 * share
    with pytest.raises(BadPart, match="crosses itself"):
        one(ring_with_lap(0.1))
