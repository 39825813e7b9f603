from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from pydantic import ValidationError

from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import Tape
from mskgrasp.perception.markers import find_markers
from tests.perception.markers.drawn import (
    BEFORE,
    HEIGHT,
    LARGE,
    SMALL,
    SQUARES,
    STEEL,
    at,
    centres,
    disc,
    draw,
    find,
    spot,
)
from tests.synthetic import INTRINSICS, OVERHEAD, TABLE_Z


@pytest.mark.parametrize("pose", [at(0.455, 0.0, 0.0), at(0.41, 0.06, 0.785), at(0.52, -0.07, -2.2)])
def test_centres_and_sides_are_found_far_finer_than_a_pixel(pose: Pose):
    found = find(draw(pose))
    assert np.abs(found.points_base - centres(pose)).max() < 0.1e-3
    assert found.sides == pytest.approx(np.array([[0.012] * 2, [0.008] * 2]), abs=0.3e-3)
    seen = OVERHEAD.inverse().apply(found.points_base)
    assert (seen @ INTRINSICS.T)[:, :2] / seen[:, 2:] == pytest.approx(found.pixels, abs=1e-9)


@pytest.mark.parametrize("gain", [0.4, 0.7, 1.1])
def test_the_exposure_does_not_matter(gain: float):
    frame = draw(BEFORE)
    assert frame.fine_colour is not None
    other = dataclasses.replace(frame, fine_colour=np.rint(gain * frame.fine_colour).astype(np.uint8))
    assert np.abs(find(other).points_base - centres(BEFORE)).max() < 0.1e-3


def test_noise_of_colour_and_depth_holes_and_flying_pixels_cost_little():
    rng = np.random.default_rng(0)
    frame = draw(BEFORE)
    assert frame.fine_colour is not None
    colour = np.clip(np.rint(frame.fine_colour + rng.normal(0, 3, frame.fine_colour.shape)), 0, 255)
    depth = frame.depth + rng.normal(0, 1.3e-3, frame.depth.shape).astype(np.float32)
    depth[rng.random(depth.shape) < 0.2] = np.nan
    depth[rng.random(depth.shape) < 0.1] += 0.02
    found = find(dataclasses.replace(frame, fine_colour=colour.astype(np.uint8), depth=depth))
    assert np.abs(found.points_base[:, :2] - centres(BEFORE)[:, :2]).max() < 0.3e-3
    assert np.abs(found.points_base[:, 2] - HEIGHT).max() < 2.5e-3


def test_stated_heights_stand_in_for_depth():
    frame = draw(BEFORE)
    blind = dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))
    found = find(blind, heights=(HEIGHT, HEIGHT))
    assert np.abs(found.points_base - centres(BEFORE)).max() < 0.1e-3
    with pytest.raises(MarkersNotFound, match="no depth: on the larger square 0 depths .* give the squares'"):
        find(blind)


def test_white_outside_the_region_does_not_matter():
    frame = draw(BEFORE, extra=lambda image: image.__setitem__(np.s_[:80, :], 255))
    with pytest.raises(MarkersNotFound, match="more than two candidates"):
        find(frame)
    found = find_markers(frame, table_z=TABLE_Z, region=(0.34, 0.55, -0.1, 0.1))
    assert np.abs(found.points_base - centres(BEFORE)).max() < 0.1e-3


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (lambda: draw(BEFORE, squares=()), "none found: .* stick both"),
        (lambda: draw(BEFORE, squares=(LARGE,)), "one found: the larger .*the smaller one is not"),
        (lambda: draw(BEFORE, squares=(SMALL,)), "one found: the smaller"),
        (lambda: draw(BEFORE, squares=(LARGE, (*LARGE[:2][::-1], 0.012))), "one found: the larger"),
        (lambda: draw(BEFORE, squares=(*SQUARES, (0, 0, 0.012))), "more than two candidates: 3 white"),
        (lambda: draw(BEFORE, squares=(*SQUARES, (0, 0, 0.02))), "more than two .* 28 x 27 mm"),
        (lambda: draw(BEFORE, extra=spot(*LARGE[:2], 0.005, 0.03, 60)), "one found: the smaller"),
        (lambda: draw(BEFORE, extra=spot(-0.034, 0.016, 0.008, 0.008, 60)), "one found: the smaller .* cut"),
        (lambda: draw(BEFORE, extra=spot(0.031, -0.012, 0.01, 0.004, 60)), "one found: the larger .* cut"),
        (lambda: draw(BEFORE, extra=disc(*LARGE[:2], 14)), "one found: the smaller .* overexposed"),
        (lambda: draw(BEFORE, extra=disc(*SMALL[:2], 6.5)), "one found: the larger .* overexposed"),
        (lambda: draw(BEFORE, extra=disc(0, 0, 8)), "more than two candidates: .* does not shine"),
        (lambda: draw(BEFORE, extra=spot(0, 0, 0.2, 0.2, 255)), "none found: .* dim the light"),
        (lambda: draw(BEFORE, white=STEEL + 7), "too little contrast: .*at least 12"),
        (lambda: draw(at(0.64, 0.0, 0.0)), "found"),
        (lambda: dataclasses.replace(draw(BEFORE), fine_colour=None), "too coarse: .* 3.7 pixels.*finer"),
        (
            lambda: dataclasses.replace(draw(BEFORE), fine_colour=np.zeros((200, 160, 3), np.uint8)),
            "not registered to depth",
        ),
    ],
    ids=[
        "no tape", "no small square", "no large square", "two large squares", "three squares", "other white",
        "a finger across", "a corner covered", "half covered", "glare over the large", "glare over the small",
        "glare between", "white-out", "hardly white", "outside", "too coarse", "not registered",
    ],
)  # fmt: skip
def test_what_is_not_two_whole_squares_is_an_error_that_says_what(frame: Callable, message: str):
    with pytest.raises(MarkersNotFound, match=message) as raised:
        find(frame())
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("sides", [(0.012, 0.010), (0.008, 0.012), (0.012, 0.001)])
def test_squares_that_may_be_taken_for_each_other_are_no_setting(sides: tuple[float, float]):
    with pytest.raises(ValidationError):
        Tape(large=sides[0], small=sides[1])
