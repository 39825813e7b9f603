"""Places of tape squares on simple shapes."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from hal.sim.tape import GAP, THICKNESS, Square, heights_from_above, place_tape
from mskgrasp.core.errors import TapeDoesNotFit
from mskgrasp.core.geometry import quat_about_z, quat_multiply, quat_rotate
from mskgrasp.core.settings import Tape

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
ON_ITS_SIDE = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])


def place(mesh: trimesh.Trimesh, quat_wxyz: np.ndarray = UPRIGHT, tape: Tape | None = None) -> list[Square]:
    return list(place_tape(mesh.vertices, mesh.faces, quat_wxyz, tape or Tape(), name="it"))


def lying(square: Square, quat_wxyz: np.ndarray) -> np.ndarray:
    """(k, 3) of its grid, as the part lies."""
    return quat_rotate(quat_wxyz, square.vertices_obj)


def block(size: tuple[float, float, float], at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("resting", [UPRIGHT, ON_ITS_SIDE], ids=["upright", "on its side"])
def test_squares_lie_on_top_of_a_block_as_far_apart_as_it_is_long(resting: np.ndarray, turn: float):
    quat_wxyz = quat_multiply(quat_about_z(np.array(turn)), resting)
    squares = place(block((0.08, 0.03, 0.03)), quat_wxyz)
    for square, side in zip(squares, Tape().sides, strict=True):
        points = lying(square, quat_wxyz)
        assert points[:, 2] == pytest.approx(0.015 + THICKNESS, abs=1e-6)
        assert quat_rotate(quat_wxyz, square.centre_obj) == pytest.approx(points.mean(axis=0), abs=1e-6)
        local = quat_rotate(quat_about_z(np.array(-turn)), points)
        assert np.ptp(local, axis=0)[:2] == pytest.approx([side, side], abs=1e-6)
        assert (np.abs(local) <= np.array([0.04, 0.015, 0.02])).all()
    # The diagonal of what the margins and the sides leave of 80 x 30 mm.
    apart = float(np.linalg.norm(squares[0].centre_obj - squares[1].centre_obj))
    assert apart == pytest.approx(np.hypot(0.08 - 0.011, 0.03 - 0.011), abs=2e-3)


def test_a_top_without_room_is_an_error_that_says_what_to_do():
    with pytest.raises(TapeDoesNotFit, match="'it'.* 12 and 8 mm .* smaller squares"):
        place(block((0.02, 0.015, 0.03)))
    assert len(place(block((0.02, 0.015, 0.03)), tape=Tape(large=0.007, small=0.005))) == 2


def test_squares_keep_clear_of_holes_and_steps():
    plate = block((0.08, 0.04, 0.01))
    step = block((0.02, 0.04, 0.02), at=(0.0, 0.0, 0.005))
    for square in place(trimesh.boolean.union([plate, step])):
        heights = lying(square, UPRIGHT)[:, 2]
        assert np.ptp(heights) < 1e-6
    washer = trimesh.creation.annulus(0.012, 0.03, 0.006)
    for square in place(washer):
        radii = np.linalg.norm(square.vertices_obj[:, :2], axis=1)
        assert radii.min() > 0.012 and radii.max() < 0.03


def test_a_wall_does_not_hide_a_square_from_a_camera_that_looks_past_it():
    """A camera 0.8 m above sees the corner of the region 12 degrees off its axis."""
    angle = trimesh.boolean.union(
        [block((0.08, 0.04, 0.004)), block((0.08, 0.004, 0.05), at=(0, -0.018, 0.025))]
    )
    for square in place(angle, tape=Tape(large=0.01, small=0.007)):
        points = lying(square, UPRIGHT)
        if points[:, 2].max() < 0.01:
            gap = points[:, 1].min() + 0.016
            assert gap >= (0.05 - 0.002 - 0.002) * np.tan(np.radians(12))


def test_tape_bends_over_a_shaft_and_squares_keep_their_distance():
    shaft = trimesh.creation.cylinder(0.015, 0.03, sections=128)
    first, second = place(shaft, ON_ITS_SIDE, Tape(large=0.01, small=0.007))
    points = lying(first, ON_ITS_SIDE)
    assert 0.2e-3 < np.ptp(points[:, 2]) < 1.5e-3
    gap = np.abs(lying(first, ON_ITS_SIDE)[:, None] - lying(second, ON_ITS_SIDE)[None])[..., :2].max(axis=-1)
    assert gap.min() >= GAP - 1e-3


def test_rays_from_above_meet_the_highest_surface():
    steps = trimesh.util.concatenate([block((10, 10, 2), at=(8, 8, 1)), block((4, 4, 3), at=(8, 8, 1.5))])
    heights = heights_from_above(steps.vertices, steps.faces)
    assert heights[8, 8] == 3 and heights[4, 4] == 2 and heights[1, 1] == -np.inf
