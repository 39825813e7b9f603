"""A film shows the part where it is, and changes nothing that is simulated."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hal import Cell, execute_grasp
from hal.sim import EDGE, Film, SapienCellConfig, SapienWorld, sapien_cell
from hal.sim.film import FRAME_S
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from mskgrasp.parts import Part


@pytest.fixture(scope="module")
def cell(block: Part) -> Iterator[Cell]:
    with sapien_cell(SapienCellConfig(type="sapien", part=str(block.folder))).connected() as cell:
        yield cell


def beside(cell: Cell, block: Part) -> Grasp:
    """A grasp along the block's y, 5 mm aside and turned by 0.1 rad: the fingers shift and turn the block."""
    assert isinstance(cell.feeder, SapienWorld)
    cell.feeder.present(str(block.folder), 3)
    pose = cell.feeder.part_pose()
    x_axis = pose.as_matrix()[:3, 0]
    turn = float(np.arctan2(x_axis[1], x_axis[0]))
    across = np.array([-np.sin(turn), np.cos(turn), 0.0])
    position = pose.position + 0.005 * across
    theta = (turn + 0.1 + np.pi / 2) % np.pi - np.pi / 2
    return Grasp(position=np.array([*position[:2], 0.015]), theta=theta)


def film(cell: Cell, grasp: Grasp) -> Film:
    assert isinstance(cell.feeder, SapienWorld)
    return Film(cell.feeder, grasp, 200)


def centre(mask: np.ndarray) -> np.ndarray:
    """(2,) centre of the pixels, x to the right and y up, metres from the picture's middle."""
    rows, columns = np.nonzero(mask)
    n = len(mask)
    return np.array([columns.mean() - (n - 1) / 2, (n - 1) / 2 - rows.mean()]) * EDGE / n


def seen_at(grasp: Grasp, T_base_obj: Pose) -> np.ndarray:
    return grasp.T_base_grasp.inverse().apply(T_base_obj.position)[:2]


@pytest.mark.slow
def test_a_film_shows_the_shift_between_the_fingers_and_leaves_the_grasp_as_it_is(cell: Cell, block: Part):
    assert cell.tracker is not None
    for _ in range(2):  # the first grasp in a new engine is rounded differently
        grasp = beside(cell, block)
        assert execute_grasp(cell, grasp).holding
        unfilmed = cell.tracker.part_pose()
    again = beside(cell, block)
    with film(cell, again).recorded() as frames:
        assert execute_grasp(cell, again).holding
    first, last = frames[0], frames[-1]
    np.testing.assert_array_equal(last.T_base_obj.as_vector(), unfilmed.as_vector())

    # What is seen is where the poses say; the fingers have brought the part to the middle between them.
    np.testing.assert_allclose(centre(first.above.part), seen_at(grasp, first.T_base_obj), atol=1e-3)
    assert first.above.part.sum() * (EDGE / 200) ** 2 == pytest.approx(0.04 * 0.02, rel=0.05)
    assert abs(seen_at(grasp, last.T_base_obj)[1]) < 1e-3 < abs(seen_at(grasp, first.T_base_obj)[1])

    # The fingers close in short steps, and the rest is filmed at an even pace.
    seconds = np.array([frame.seconds for frame in frames])
    assert np.all(np.diff(seconds) >= 0) and np.diff(seconds).max() < 2 * FRAME_S
    rows = [np.nonzero(frame.above.fingers)[0] for frame in frames if frame.above.fingers.any()]
    assert len(rows) > 15
    assert first.side.part.any() and first.side.empty.any() and not first.above.empty.any()


@pytest.mark.slow
def test_the_hand_is_hidden_from_above_only(cell: Cell, block: Part):
    grasp = beside(cell, block)
    with film(cell, grasp).recorded() as frames:
        cell.arm.move_to_pose(grasp.raised(0.03).T_base_tcp)
    last = frames[-1]
    assert last.above.part.any() and last.above.fingers.any()
    # A picture of the whole hand from above would hide the part.
    assert last.above.part.sum() == pytest.approx(frames[0].above.part.sum(), rel=0.02)
    assert last.side.fingers.any()
    overhead = cell.camera.capture().depth
    assert np.nanmin(overhead) < 0.6  # the arm is visible again
