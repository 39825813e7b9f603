"""Motion of a part measured by rendered tape, against the pose that was set."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from hal import Cell, execute_grasp, go_home, put_down
from hal.errors import MotionAborted
from hal.operator import Operator
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.geometry import quat_rotate, wrap_half_turn
from mskgrasp.core.grasp import Grasp, object_displacement
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import find_part
from mskgrasp.perception.markers import planar_displacement
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from mskgrasp.trials import measurement
from mskgrasp.trials.engine import PlannedGrasp, TrialEngine
from tests.hal.sim.marked_parts import (
    GREY_NOISE,
    PARTS,
    TAPE,
    Motion,
    blot,
    errors,
    find,
    littered,
    marked_cell,
    noisy,
    present,
    random_motion,
    small_motion,
    world,
)


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    cell = marked_cell()
    with cell.camera:
        yield cell


@pytest.mark.parametrize(
    "part", [*PARTS[:2], *(pytest.param(part, marks=pytest.mark.slow) for part in PARTS[2:])]
)
def test_a_known_motion_is_measured_to_half_a_millimetre_and_half_a_degree(cell: Cell, part: str):
    resting, rng = present(cell, part), np.random.default_rng(PARTS.index(part))
    for _ in range(2):
        motion = random_motion(cell, resting, rng)
        distance, angle = errors(cell, motion)
        assert distance < 0.5 and angle < 0.5
        distance, angle = errors(cell, motion, tuple(noisy(frame, rng) for frame in motion.frames))
        assert distance < 0.7 and angle < 0.9, f"with a Kinect's noise and {GREY_NOISE} grey levels"


@pytest.mark.slow
def test_a_grasp_that_shifts_and_turns_a_part_is_measured_on_the_table_as_it_was_in_the_hand(cell: Cell):
    """Askew and off the middle: the truth is the pose in the hand, while the part is held aloft."""
    resting = present(cell, "parallel_key_b20x12x80")
    lengthwise = quat_rotate(
        resting.quat_wxyz, np.eye(3)[find_part("parallel_key_b20x12x80").extents.argmax()]
    )
    grasp = Grasp(
        position=np.array([*(resting.position[:2] + [0.004, 0.006]), 0.0115]),
        theta=wrap_half_turn(np.arctan2(lengthwise[1], lengthwise[0]) + 0.25),
    )
    with cell.arm:
        before = find(cell, cell.camera.capture())
        result = execute_grasp(cell, grasp)
        assert result.holding and result.aborted is None
        T_tcp_obj = result.T_base_tcp.inverse() @ world(cell).part_pose()
        put_down(cell, grasp, height=0.0)
        go_home(cell)
        after = find(cell, cell.camera.capture())
    true, _ = object_displacement(grasp.T_base_tcp.inverse() @ resting, T_tcp_obj)
    measured = planar_displacement(before, after, grasp, resting.position)
    assert abs(true[3]) > np.radians(10) and np.hypot(*true[:2]) > 2e-3
    assert np.hypot(*(measured[:2] - true[:2])) < 0.5e-3
    assert np.degrees(abs(measured[2] - true[3])) < 0.5


def test_a_hand_that_meets_something_as_it_lets_go_measures_nothing(cell: Cell, monkeypatch):
    """The part may have been moved: it is lifted, not measured, and no longer in the hand."""
    present(cell, "parallel_key_b20x12x80")
    workspace = cell.workspace
    planner = Planner(
        load_models(PRETRAINED),
        PlannerConfig(n_candidates=200, policy="quality"),
        table_z=workspace.table_z,
        region=workspace.region,
    )
    let_go, recovered = measurement.let_go, []

    def met(cell: Cell, place: Grasp, *, opening: float, tallest: float) -> None:
        let_go(cell, place, opening=opening, tallest=tallest)
        raise MotionAborted("contact")

    monkeypatch.setattr(measurement, "let_go", met)
    monkeypatch.setattr(Operator, "recover", lambda self, cell, reason: recovered.append(reason))
    engine = TrialEngine(cell, Operator(cell), tape=TAPE)
    with cell.arm:
        go_home(cell)
        frame = engine.capture()
        planned = PlannedGrasp(frame=frame, plan=planner.plan(frame, np.random.default_rng(0)))
        record = measurement.run_trial(engine, planned, part="key", number=0, seed=0)
    assert record.trial.success and record.trial.measured is None
    assert record.trial.unmeasured.startswith("touched") and recovered == ["contact"] and not record.in_hand


@pytest.mark.parametrize(
    ("displacement", "deviation", "room"),
    [(0.0, 0.0, 0.08), (-0.01, 0.002, 0.052), (0.015, np.nan, 0.05), (0.05, 0.001, 0.0)],
)
def test_the_fingers_have_as_much_room_as_the_displacement_leaves(displacement, deviation, room):
    plan = SimpleNamespace(
        displacement=np.array([0.03, displacement, 0.0, 0.0]), displacement_std=np.full(4, deviation)
    )
    assert measurement.safe_opening(plan) == pytest.approx(room)  # type: ignore[arg-type]  # all that it reads


@pytest.fixture(scope="module")
def motion(cell: Cell) -> Motion:
    """A pillow block that was moved by a few millimetres and degrees."""
    return small_motion(cell, present(cell, "pillow_block_80x32"))


@pytest.mark.parametrize("hand", [(0.505, 0.004, 0.05, 0.4), (0.47, -0.05, 0.15, -0.6)])
def test_a_hand_in_the_way_is_an_error(cell: Cell, motion: Motion, hand: tuple[float, ...]):
    joints, reached = top_down(torch.tensor([hand], dtype=torch.float64))
    assert bool(reached.all())
    env = world(cell).env
    home = env.agent.robot.get_qpos()[:, :7].double()
    env.motion.place(joints)
    try:
        frame = cell.camera.capture()
    finally:
        env.motion.place(home)
    with pytest.raises(MarkersNotFound, match="found|candidates|contrast"):
        find(cell, frame)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(
    ("size", "grey", "round_"),
    [((24, 24), 40, False), ((24, 24), 190, False), ((12, 12), 255, True), ((25, 25), 255, True)],
    ids=["covered", "covered by steel", "glare", "large glare"],
)
def test_a_covered_or_overexposed_square_is_an_error(
    cell: Cell, motion: Motion, which: int, size: tuple[float, float], grey: int, round_: bool
):
    frame = motion.frames[1]
    with pytest.raises(MarkersNotFound, match="found|candidates|contrast"):
        find(cell, blot(frame, find(cell, frame).pixels[which], size, grey, round_=round_))


def test_whatever_lies_near_a_square_it_is_never_a_wrong_number(cell: Cell, motion: Motion):
    """Things of every size and brightness, thrown on the picture: an error, or still the right answer."""
    rng, found = np.random.default_rng(0), 0
    for frame in littered(cell, motion.frames[1], 12, rng):
        try:
            distance, angle = errors(cell, motion, (motion.frames[0], frame))
        except MarkersNotFound:
            continue
        found += 1
        assert distance < 0.5 and angle < 0.75
    assert found < 8


def test_tape_is_seen_and_nothing_else_changes(cell: Cell):
    """Colour without tape and fine colour is, to the bit, that of a cell which knows of neither."""
    with marked_cell(scale=1, tape=None).camera as camera:
        plain = camera.capture()
    with marked_cell(scale=3, tape=None).camera as camera:
        fine = camera.capture()
    assert plain.fine_colour is None and fine.fine_colour is not None
    assert fine.fine_colour.shape == (3 * plain.depth.shape[0], 3 * plain.depth.shape[1], 3)
    assert np.array_equal(plain.colour, fine.colour) and np.array_equal(plain.depth, fine.depth)
    middle = fine.fine_colour[1::3, 1::3].astype(int) - plain.colour  # registered: the same pixel, finer
    assert (np.abs(middle).max(axis=2) > 8).mean() < 0.02
    world(cell).present(PARTS[0], 0)
    taped = cell.camera.capture()
    changed = np.abs(taped.colour.astype(int) - plain.colour).max(axis=2) > 0
    area = changed.sum() * (0.765 / 365.5) ** 2
    assert area == pytest.approx(0.012**2 + 0.008**2, rel=0.25)
    assert np.abs(taped.depth - plain.depth)[~changed].max() == 0
    assert np.abs(taped.depth - plain.depth).max() < 5e-4
