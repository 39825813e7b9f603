"""Contract of every arm: the simulated ones, both drivers of a Franka arm over the wire, and a replay.

The arm of a recording knows what happened and nothing else. Each test is therefore first run on the simulated
arm while it is recorded, which holds that one to the contract, too, and then on what was recorded.
"""

from __future__ import annotations

import dataclasses
import inspect
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np
import pytest

from hal import Arm, Cell, Load, cell_from_yaml, execute_grasp
from hal.arm import JOINT_TOLERANCE, POSITION_TOLERANCE, ROTATION_TOLERANCE
from hal.errors import LoadTooHeavy, MotionAborted, NeedsRecovery, NotConnected, OutOfWorkspace, Stopped
from hal.open_cell import SIMULATED
from hal.replay import ReplayArm, ReplayArmConfig, recorded_cell
from hal.replay.recorder import RecordingArm
from mskgrasp.core.geometry import Pose, pose_distance, quat_multiply
from mskgrasp.core.grasp import PAD_REACH, Grasp, pose_base_tcp
from tests.hal.franka.robots import robot_for, write_cell
from tests.hal.replay.toy import toy_cell
from tests.hal_contract.conftest import CELLS

TOUCHED = pose_base_tcp(np.array([0.4, -0.1, -0.02, 0.0]))
"""Under a place of the table where no part lies."""
BACK = Pose(position=np.array([0.0, 0.0, -0.06]), quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]))
"""Away from what the hand points at."""
STILL_RAD, STILL_M = 2e-3, 1e-3
"""An arm in MuJoCo creeps by this much when it stands."""


def backend(name: str, folder: Path) -> AbstractContextManager[Path]:
    """The file of a cell with an arm of that backend, which has something to talk to."""

    @contextmanager
    def serve() -> Iterator[Path]:
        if name in SIMULATED:
            yield CELLS / f"{name}.yaml"
        elif name == "replay":
            with recorded_cell(toy_cell(), folder / "toy.h5").connected() as cell:
                cell.arm.move_gripper(0.05)
                cell.arm.state()
            path = folder / "replay.yaml"
            path.write_text(f"type: replay\nrecording: {folder / 'toy.h5'}\n")
            yield path
        elif name == "franky" or name == "panda_py":
            with robot_for(name) as robot:
                robot.order("table 0.0 0.0")
                yield write_cell(folder, name, robot.host)
        else:
            raise ValueError(name)

    return serve()


PANDA_PY = pytest.param("panda_py", marks=pytest.mark.slow)


@pytest.fixture(params=[*SIMULATED, "franky", PANDA_PY, "replay"], scope="module")
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def world(name: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """A cell whose arm is connected; where it will be recorded, the camera keeps the simulation going."""
    with backend("sapien" if name == "replay" else name, tmp_path_factory.mktemp(name)) as path:
        cell = cell_from_yaml(path)
        with cell.camera if name == "replay" else cell.arm:
            yield cell


@pytest.fixture
def cell(world: Cell, name: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Cell]:
    """Connected, at home, without a fault."""
    if name != "replay":
        with at_home(world):
            yield world
        return
    recording = tmp_path / "test.h5"
    recorded = recorded_cell(world, recording)
    with recorded.arm, at_home(recorded):
        rehearse(request, recorded)
    with ReplayArm(ReplayArmConfig(driver="replay", recording=recording)) as arm:
        replayed = dataclasses.replace(world, arm=arm)
        with at_home(replayed):
            yield replayed


@contextmanager
def at_home(cell: Cell) -> Iterator[None]:
    cell.arm.recover()
    cell.arm.move_gripper(0.08)
    cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
    yield
    cell.arm.recover()


def rehearse(request: pytest.FixtureRequest, recorded: Cell) -> None:
    """Runs the test that asks for a replay on the recorded cell."""
    given = {**request.node.callspec.params, "cell": recorded, "name": "sapien"}
    wanted = inspect.signature(request.function).parameters
    request.function(**{key: given[key] if key in given else request.getfixturevalue(key) for key in wanted})


@contextmanager
def stopped_after(seconds: float, cell: Cell, name: str) -> Iterator[None]:
    """Calls stop() from another thread; what was recorded was stopped then, and needs no second one."""
    timer = threading.Timer(600 if name == "replay" else seconds, cell.arm.stop)
    timer.start()
    try:
        yield
    finally:
        if name == "replay":
            timer.cancel()
        timer.join()


def joints_at_rest(arm: Arm) -> np.ndarray:
    deadline = time.monotonic() + 60
    last, quiet = arm.state().joints, 0
    while quiet < 3:
        assert time.monotonic() < deadline, "the arm goes on"
        time.sleep(0.1)
        now = arm.state().joints
        quiet = quiet + 1 if np.abs(now - last).max() < 1e-3 else 0
        last = now
    return last


def over_the_table(z: float = 0.3, theta: float = 0.0) -> Pose:
    return pose_base_tcp(np.array([0.42, 0.05, z, theta]))


def test_state_has_units_and_shapes(cell: Cell):
    state = cell.arm.state()
    assert state.joints.shape == (7,) and np.abs(state.joints).max() < 3.8
    assert state.T_base_tcp.position.shape == (3,) and state.T_base_tcp.quat_wxyz.shape == (4,)
    assert np.linalg.norm(state.T_base_tcp.quat_wxyz) == pytest.approx(1.0, abs=1e-5)
    assert -STILL_M <= state.gripper_width <= 0.08 + STILL_M
    assert state.timestamp_s <= time.monotonic()


def test_the_hand_at_home_points_down_over_the_table(cell: Cell):
    """The Panda's ready pose by its documentation: 0.307 m in front, 0.487 m up, the hand straight down."""
    pose = cell.arm.state().T_base_tcp
    assert pose.position == pytest.approx([0.307, 0.0, 0.487], abs=5e-3)
    assert abs(pose.quat_wxyz[1]) == pytest.approx(1.0, abs=1e-3)


def test_a_joint_motion_arrives(cell: Cell):
    target = cell.workspace.home + np.array([0.2, 0.1, -0.1, 0.2, 0.1, -0.2, 0.2])
    cell.arm.move_to_joints(target, speed=0.8)
    assert cell.arm.state().joints == pytest.approx(target, abs=JOINT_TOLERANCE)


@pytest.mark.parametrize("theta", [0.0, 1.2, -1.5])
def test_a_straight_motion_arrives(cell: Cell, theta: float):
    target = over_the_table(theta=theta)
    cell.arm.move_to_pose(target, speed=0.5)
    reached = cell.arm.state().T_base_tcp
    distance, angle = pose_distance(reached, target)
    assert distance < POSITION_TOLERANCE and angle < ROTATION_TOLERANCE


@pytest.mark.parametrize("name", ["franky", PANDA_PY], indirect=True, scope="module")
def test_a_straight_motion_is_straight(cell: Cell):
    """Measured on the way, from another thread, while the arm moves; SAPIEN's has its own test."""
    begin, target = cell.arm.state().T_base_tcp.position, over_the_table()
    seen: list[np.ndarray] = []
    done = threading.Event()

    def watch() -> None:
        while not done.wait(0.05):
            seen.append(cell.arm.state().T_base_tcp.position)

    watcher = threading.Thread(target=watch)
    watcher.start()
    cell.arm.move_to_pose(target, speed=0.3)
    done.set()
    watcher.join()
    way = (target.position - begin) / np.linalg.norm(target.position - begin)
    offsets = [p - begin - way * np.dot(p - begin, way) for p in seen]
    assert len(seen) > 5
    assert max(float(np.linalg.norm(offset)) for offset in offsets) < 4e-3


def test_a_closed_hand_stands_where_it_touches_the_table_and_moves_on(cell: Cell):
    arm = cell.arm
    arm.move_gripper(0.0)
    arm.move_to_pose(TOUCHED @ BACK, speed=0.5)
    contact = arm.move_until_contact(TOUCHED, force=5.0, speed=0.02)
    assert contact is not None
    assert contact.position == pytest.approx([*TOUCHED.position[:2], PAD_REACH], abs=1e-3)
    assert pose_distance(arm.state().T_base_tcp, contact)[0] < 1.5e-3
    arm.move_to_pose(TOUCHED @ BACK, speed=0.5)  # a contact is no fault


def test_a_hand_that_meets_nothing_arrives(cell: Cell):
    target = TOUCHED @ BACK
    cell.arm.move_gripper(0.0)
    assert cell.arm.move_until_contact(target @ BACK, speed=0.05) is None
    assert cell.arm.move_until_contact(target, speed=0.05) is None
    assert pose_distance(cell.arm.state().T_base_tcp, target)[0] < POSITION_TOLERANCE


def test_the_gripper_reaches_a_width(cell: Cell):
    cell.arm.move_gripper(0.03)
    assert cell.arm.state().gripper_width == pytest.approx(0.03, abs=2e-3)


def test_grasping_nothing_is_an_outcome(cell: Cell):
    outcome = cell.arm.grasp(20.0)
    assert not outcome.holding and outcome.width < 1e-3


def test_a_hand_opens_as_far_as_it_does_and_knows_how_far(cell: Cell):
    cell.arm.move_gripper(0.02)
    cell.arm.open_gripper()
    state = cell.arm.state()
    assert 0.078 <= state.max_width <= 0.082
    assert state.gripper_width == pytest.approx(state.max_width, abs=2e-3)
    assert state.grasped in (False, None)


def test_homing_moves_the_fingers_alone_and_the_hand_works_on(cell: Cell):
    before = cell.arm.state().joints
    cell.arm.home()
    assert cell.arm.state().joints == pytest.approx(before, abs=STILL_RAD)
    cell.arm.move_gripper(0.03)
    assert cell.arm.state().gripper_width == pytest.approx(0.03, abs=2e-3)


def test_a_closed_hand_holds_by_the_same_rule_at_any_time(cell: Cell):
    outcome, state = cell.arm.grasp(20.0), cell.arm.state()
    assert outcome.holding is cell.arm.holds(state) is False
    held = dataclasses.replace(state, gripper_width=0.03, grasped=None)
    assert cell.arm.holds(held) and not cell.arm.holds(dataclasses.replace(held, grasped=False))


def test_a_part_in_the_hand_may_be_stated_unless_it_is_too_heavy(cell: Cell):
    arm, load = cell.arm, Load(mass=0.2, centre_tcp=np.zeros(3), inertia=1e-4 * np.eye(3))
    arm.set_load(load)
    with pytest.raises(LoadTooHeavy) as caught:
        arm.set_load(dataclasses.replace(load, mass=20.0))
    assert "weighs 20.000 kg" in str(caught.value) and "\n" not in str(caught.value)
    before = arm.state().joints
    with pytest.raises(LoadTooHeavy):
        grasp = Grasp.from_vector(np.array([0.45, 0.0, 0.02, 0.0]))
        execute_grasp(cell, grasp, load=dataclasses.replace(load, mass=20.0))
    assert arm.state().joints == pytest.approx(before, abs=STILL_RAD)
    arm.set_load(None)
    arm.set_load(load)
    arm.open_gripper()  # which releases it
    arm.move_gripper(0.06)  # a refusal is no fault


def test_a_hand_that_has_closed_is_open_when_it_says_so(cell: Cell):
    cell.arm.grasp(20.0)
    cell.arm.move_gripper(0.08)
    assert cell.arm.state().gripper_width == pytest.approx(0.08, abs=2e-3)


def test_a_command_outside_the_limits_is_refused_and_nothing_moves(cell: Cell):
    arm, before = cell.arm, cell.arm.state()
    for command in (
        lambda: arm.move_to_joints(np.array([0, 0, 0, 0.5, 0, 1.5, 0])),
        lambda: arm.move_to_joints(np.array([0, 0, 0, np.nan, 0, 1.5, 0])),
        lambda: arm.move_to_joints(np.zeros(6)),
        lambda: arm.move_to_joints(cell.workspace.home, speed=1.5),
        lambda: arm.move_to_joints(np.array([0.0, 0.9, 0.0, -1.9, 0.0, 2.8, 0.785])),  # into the table
        lambda: arm.move_to_pose(pose_base_tcp(np.array([0.5, 0.0, 0.005, 0.0]))),
        lambda: arm.move_to_pose(pose_base_tcp(np.array([1.5, 0.0, 0.2, 0.0]))),
        lambda: arm.move_to_pose(pose_base_tcp(np.array([0.5, np.nan, 0.2, 0.0]))),
        lambda: arm.move_to_pose(over_the_table(), speed=0.0),
        lambda: arm.move_until_contact(TOUCHED, force=50.0),
        lambda: arm.move_until_contact(TOUCHED, speed=0.2),
        lambda: arm.move_until_contact(pose_base_tcp(np.array([0.5, 0.0, -0.06, 0.0]))),
        lambda: arm.move_until_contact(pose_base_tcp(np.array([0.9, 0.0, 0.0, 0.0]))),
        lambda: arm.move_gripper(0.2),
        lambda: arm.move_gripper(-0.01),
        lambda: arm.grasp(500.0),
        lambda: arm.grasp(0.0),
    ):
        with pytest.raises(OutOfWorkspace) as caught:
            command()
        assert "\n" not in str(caught.value)
    after = arm.state()
    assert after.joints == pytest.approx(before.joints, abs=STILL_RAD)
    assert after.gripper_width == pytest.approx(before.gripper_width, abs=STILL_M)
    arm.move_gripper(0.06)  # a refusal is no fault


def test_a_line_that_leaves_the_reach_on_its_way_is_refused(cell: Cell):
    """Both ends are reachable; the arm would have to turn by more than a joint's range."""
    arm = cell.arm
    arm.move_to_joints(np.array([0.0, 0.0, 0.0, -2.2, 0.0, 2.2, -2.2]), speed=0.8)
    joints_at_rest(arm)
    here = arm.state()
    target = Pose(
        position=here.T_base_tcp.position,
        quat_wxyz=quat_multiply(np.array([np.cos(0.8), 0.0, 0.0, np.sin(0.8)]), here.T_base_tcp.quat_wxyz),
    )
    with pytest.raises(OutOfWorkspace, match="no straight line"):
        arm.move_to_pose(target)
    assert arm.state().joints == pytest.approx(here.joints, abs=STILL_RAD)
    arm.move_gripper(0.07)


def test_a_tilted_hand_keeps_its_corners_off_the_table(cell: Cell):
    level = pose_base_tcp(np.array([0.5, 0.0, 0.02, 0.0]))
    tilted = Pose(
        position=level.position,
        quat_wxyz=quat_multiply(np.array([np.cos(0.3), np.sin(0.3), 0.0, 0.0]), level.quat_wxyz),
    )
    cell.arm.check_pose(level)
    with pytest.raises(OutOfWorkspace, match="table"):
        cell.arm.check_pose(tilted)


def test_a_grasp_out_of_reach_is_refused_before_anything_moves(cell: Cell):
    before = cell.arm.state()
    with pytest.raises(OutOfWorkspace, match="reach"):
        execute_grasp(cell, Grasp.from_vector(np.array([0.74, 0.39, 0.02, 0.0])))
    after = cell.arm.state()
    assert after.joints == pytest.approx(before.joints, abs=STILL_RAD)
    assert after.gripper_width == pytest.approx(before.gripper_width, abs=STILL_M)


def test_stop_from_another_thread_ends_a_motion_and_nothing_moves_before_recover(cell: Cell, name: str):
    far = cell.workspace.home + np.array([0.5, 0, 0, 0, 0, 0, 0])
    with stopped_after(0.05 if name in SIMULATED else 0.6, cell, name):
        with pytest.raises((Stopped, NeedsRecovery), match="stop"):
            for k in range(200):  # a simulated motion may be quicker than the timer
                cell.arm.move_to_joints(far if k % 2 == 0 else cell.workspace.home)
    stopped = joints_at_rest(cell.arm)
    with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
        cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
    with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
        cell.arm.grasp(20.0)
    assert cell.arm.state().joints == pytest.approx(stopped, abs=1e-2)
    cell.arm.recover()
    cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
    assert cell.arm.state().joints == pytest.approx(cell.workspace.home, abs=JOINT_TOLERANCE)


@pytest.mark.parametrize(
    "command",
    [
        lambda arm, k: arm.move_gripper(0.02 if k % 2 == 0 else 0.08),
        lambda arm, k: arm.grasp(20.0),
        lambda arm, k: arm.wait(5.0),
        lambda arm, k: arm.move_to_pose(over_the_table(0.3 if k % 2 == 0 else 0.35)),
        lambda arm, k: arm.move_until_contact(over_the_table(0.45 if k % 2 == 0 else 0.4), speed=0.05),
    ],
    ids=["gripper", "grasp", "wait", "line", "touch"],
)
def test_stop_ends_every_kind_of_motion(cell: Cell, name: str, command):
    with stopped_after(0.005 if name in SIMULATED else 0.2, cell, name):
        with pytest.raises((Stopped, NeedsRecovery), match="stop"):
            for k in range(200):  # a simulated motion may be quicker than the timer
                command(cell.arm, k)
    with pytest.raises(NeedsRecovery):
        command(cell.arm, 0)


def test_an_interrupted_program_leaves_an_arm_that_must_be_recovered(cell: Cell, name: str, monkeypatch):
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    moved = cell.arm._arm if isinstance(cell.arm, RecordingArm) else cell.arm
    with monkeypatch.context() as patch:
        patch.setattr(moved, "_move_to_joints", interrupt)
        # A recorded Ctrl-C must not end the program that plays it back.
        with pytest.raises(MotionAborted if name == "replay" else KeyboardInterrupt):
            cell.arm.move_to_joints(cell.workspace.home, speed=1.0)
    with pytest.raises(NeedsRecovery):
        cell.arm.move_gripper(0.05)


def test_an_arm_outside_its_context_refuses_and_can_be_opened_again(name: str, tmp_path: Path):
    with backend(name, tmp_path) as path:
        cell = cell_from_yaml(path)
        arm = cell.arm
        moves = (arm.home, arm.open_gripper, lambda: arm.move_gripper(0.05), lambda: arm.set_load(None))
        for command in (arm.state, arm.recover, *moves):
            with pytest.raises(NotConnected):
                command()
        cell.arm.close()
        for _ in range(2):
            with cell.arm:
                cell.arm.move_gripper(0.05)
                assert cell.arm.state().gripper_width == pytest.approx(0.05, abs=2e-3)
            cell.arm.close()
        with pytest.raises(NotConnected):
            cell.arm.state()
