"""Tape squares drawn where they are known to be: every pixel gathers the light of its whole area."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from hal.camera import RgbdFrame
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import Pose, quat_about_z, wrap_angle
from mskgrasp.core.grasp import object_displacement, pose_base_tcp
from mskgrasp.core.settings import Tape
from mskgrasp.perception.markers import Markers, check_between_pads, find_markers, planar_displacement
from tests.synthetic import INTRINSICS, N_PIXELS, OVERHEAD, REGION, TABLE_Z

SCALE, OVERSAMPLING = 3, 4
TABLE, STEEL, WHITE = 139, 195, 228
SIZE = (0.09, 0.05)
HEIGHT = 0.03
SQUARES = ((-0.03, 0.012, 0.012), (0.031, -0.008, 0.008))
"""x, y, side in the part's frame, metres."""
GRASP = np.array([0.44, 0.01, 0.0115, 0.4])


def at(x: float, y: float, turn: float) -> Pose:
    """``T_base_obj`` of a plate, its origin at half of its height."""
    return Pose(position=np.array([x, y, HEIGHT / 2]), quat_wxyz=quat_about_z(np.array(turn)))


def corners(x: float, y: float, width: float, length: float, pose: Pose, height: float) -> np.ndarray:
    """(4, 2) of a rectangle on the part, in pixels of depth."""
    half = np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) * [width / 2, length / 2]
    level = np.full(4, height - HEIGHT / 2)
    points = OVERHEAD.inverse().apply(pose.apply(np.column_stack([half + [x, y], level])))
    return (points @ INTRINSICS.T)[:, :2] / points[:, 2:]


def paint(image: np.ndarray, pixels: np.ndarray, grey: int) -> None:
    fine = SCALE * OVERSAMPLING
    cv2.fillConvexPoly(image, np.rint(((pixels + 0.5) * fine - 0.5) * 256).astype(np.int32), grey, shift=8)


def draw(
    pose: Pose,
    *,
    squares: tuple[tuple[float, float, float], ...] = SQUARES,
    extra: Callable[[np.ndarray], None] = lambda image: None,
    white: int = WHITE,
) -> RgbdFrame:
    image = np.full((N_PIXELS * SCALE * OVERSAMPLING,) * 2, TABLE, np.uint8)
    outline = corners(0, 0, *SIZE, pose, HEIGHT)
    paint(image, outline, STEEL)
    for x, y, side in squares:
        paint(image, corners(x, y, side, side, pose, HEIGHT), white)
    extra(image)
    gathered = image.reshape(N_PIXELS * SCALE, OVERSAMPLING, -1, OVERSAMPLING).mean(axis=(1, 3))
    fine = np.repeat(np.rint(gathered).astype(np.uint8)[..., None], 3, axis=2)
    depth = np.full((N_PIXELS, N_PIXELS), OVERHEAD.position[2], np.float32)
    cv2.fillConvexPoly(depth, np.rint(outline).astype(np.int32), OVERHEAD.position[2] - HEIGHT)
    return RgbdFrame(
        colour=fine[1::3, 1::3].copy(),
        fine_colour=fine,
        depth=depth,
        intrinsics=INTRINSICS,
        T_base_camera=OVERHEAD,
        timestamp_s=0.0,
        serial="drawn",
    )


def find(frame: RgbdFrame, heights: tuple[float, float] | None = None) -> Markers:
    return find_markers(frame, table_z=TABLE_Z, region=REGION, heights=heights)


def centres(pose: Pose) -> np.ndarray:
    return pose.apply(np.array([[x, y, HEIGHT / 2] for x, y, _ in SQUARES]))


BEFORE = at(0.45, -0.01, 0.5)
AFTER = at(0.456, -0.013, 0.62)


@pytest.fixture(scope="module")
def before() -> Markers:
    return find(draw(BEFORE))


@pytest.mark.parametrize("pose", [at(0.455, 0.0, 0.0), at(0.41, 0.06, 0.785), at(0.52, -0.07, -2.2)])
def test_centres_and_sides_are_found_far_finer_than_a_pixel(pose: Pose):
    found = find(draw(pose))
    assert np.abs(found.points_base - centres(pose)).max() < 0.1e-3
    assert found.sides == pytest.approx(np.array([[0.012] * 2, [0.008] * 2]), abs=0.3e-3)
    seen = OVERHEAD.inverse().apply(found.points_base)
    assert (seen @ INTRINSICS.T)[:, :2] / seen[:, 2:] == pytest.approx(found.pixels, abs=1e-9)


@pytest.mark.parametrize("turn", [0.12, -0.5, 1.8, 3.0])
def test_the_displacement_is_that_of_the_parts_origin_in_the_grasp_frame(before: Markers, turn: float):
    """Against the definition: poses of the part in the hand before and after."""
    pose = at(0.447, 0.004, 0.5 + turn)
    T_tcp_base = pose_base_tcp(GRASP).inverse()
    true, _ = object_displacement(T_tcp_base @ BEFORE, T_tcp_base @ pose)
    measured = planar_displacement(before, find(draw(pose)), GRASP, BEFORE.position)
    assert np.abs(measured[:2] - true[:2]).max() < 0.1e-3
    assert abs(wrap_angle(measured[2] - true[3])) < np.radians(0.15)


def test_a_turn_about_the_parts_origin_does_not_move_it(before: Markers):
    after = find(draw(at(0.45, -0.01, 0.8)))
    dx, dy, dtheta = planar_displacement(before, after, GRASP, BEFORE.position)
    assert np.hypot(dx, dy) < 0.1e-3 and dtheta == pytest.approx(0.3, abs=np.radians(0.15))


def test_a_wrong_centre_costs_what_the_turn_makes_of_it(before: Markers):
    after = find(draw(AFTER))
    right = planar_displacement(before, after, GRASP, BEFORE.position)
    wrong = planar_displacement(before, after, GRASP, BEFORE.position + [0.002, 0, 0])
    cost = float(np.linalg.norm(wrong - right))
    assert cost == pytest.approx(2 * np.sin(0.12 / 2) * 0.002, rel=0.02) and wrong[2] == right[2]


def turned_about_the_tcp(centre: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]]) @ centre - centre


SWUNG = turned_about_the_tcp(np.array([0.06, 0.01]), 0.4)


@pytest.mark.parametrize(
    ("displacement", "width", "possible"),
    [
        ((0.004, 0.017, 0.0), 0.046, True),  # each pad closed by 17 mm
        ((0.004, -0.022, 0.0), 0.046, False),
        ((0.0016, 0.052, -0.01), 0.046, False),  # drawn along by the rising hand
        ((SWUNG[0], SWUNG[1], 0.4), 0.07, True),  # the far end swings by 24 mm
        ((SWUNG[0], SWUNG[1] + 0.009, 0.4), 0.07, False),
    ],
)
def test_what_no_jaw_can_have_moved_is_a_mismatch(displacement, width, possible):
    centre = np.array([0.06, 0.01, 0.0])
    if possible:
        check_between_pads(np.array(displacement), centre, width)
        return
    with pytest.raises(MarkersNotFound, match="dragged along"):
        check_between_pads(np.array(displacement), centre, width)


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


def test_known_heights_stand_in_for_depth():
    frame = draw(BEFORE)
    blind = dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))
    found = find(blind, heights=(HEIGHT, HEIGHT))
    assert np.abs(found.points_base - centres(BEFORE)).max() < 0.1e-3
    with pytest.raises(MarkersNotFound, match="no depth: on the larger square 0 depths .* tell the squares'"):
        find(blind)


def test_white_outside_the_region_does_not_matter():
    frame = draw(BEFORE, extra=lambda image: image.__setitem__(np.s_[:80, :], 255))
    with pytest.raises(MarkersNotFound, match="more than two candidates"):
        find(frame)
    found = find_markers(frame, table_z=TABLE_Z, region=(0.34, 0.55, -0.1, 0.1))
    assert np.abs(found.points_base - centres(BEFORE)).max() < 0.1e-3


def spot(x: float, y: float, width: float, length: float, grey: int) -> Callable[[np.ndarray], None]:
    return lambda image: paint(image, corners(x, y, width, length, BEFORE, HEIGHT), grey)


def disc(x: float, y: float, radius_px: float) -> Callable[[np.ndarray], None]:
    def show(image: np.ndarray) -> None:
        middle = (corners(x, y, 0, 0, BEFORE, HEIGHT)[0] + 0.5) * SCALE * OVERSAMPLING
        cv2.circle(image, np.rint(middle).astype(int).tolist(), round(radius_px * OVERSAMPLING), 255, -1)

    return show


LARGE, SMALL = SQUARES


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(points_base=[[0, 0, 0], [0.0015, 0, 0]]), "mismatch: the squares were .* mm apart"),
        (
            dict(points_base=[[0, 0, 0.005], [0, 0, 0]]),
            r"mismatch: the squares lie \+5.0 and \+0.0 mm higher",
        ),
        (dict(points_base=[[0, 0, np.nan], [0, 0, 0]]), "mismatch"),
        (dict(sides=[[0, 0], [0, -0.001]]), "mismatch: a side of the smaller square has changed by 1.0 mm"),
    ],
)
def test_squares_that_are_not_those_of_before_are_a_mismatch(before: Markers, change: dict, message: str):
    values = {name: getattr(before, name) + np.array(by) for name, by in change.items()}
    along = np.diff(before.points_base[:, :2], axis=0)
    assert abs(along[0, 0]) > 0.04  # so that a shift along x changes the distance
    with pytest.raises(MarkersNotFound, match=message):
        planar_displacement(before, dataclasses.replace(before, **values), GRASP, BEFORE.position)


def test_a_square_that_is_covered_a_little_after_the_grasp_is_a_mismatch(before: Markers):
    """Too little to be no square of its size, enough to move its centre."""
    edge = LARGE[1] + 0.006
    after = find(draw(BEFORE, extra=spot(LARGE[0], edge, 0.02, 0.0024, STEEL)))
    with pytest.raises(MarkersNotFound, match="mismatch: a side of the larger square"):
        planar_displacement(before, after, GRASP, BEFORE.position)


@pytest.mark.parametrize("sides", [(0.012, 0.010), (0.008, 0.012), (0.012, 0.001)])
def test_squares_that_may_be_taken_for_each_other_are_no_setting(sides: tuple[float, float]):
    with pytest.raises(ValidationError):
        Tape(large=sides[0], small=sides[1])
