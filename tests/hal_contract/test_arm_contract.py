"""Contract of every arm: the simulated ones, both drivers of a Franka arm over the wire, and a replay.

The arm of a recording knows what happened and nothing else. Each test is therefore first run on the simulated
arm while it is recorded, which holds that one to the contract, too, and then on what was recorded.
"""

from __future__ import annotations

import dataclasses
import inspect
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np
import pytest

from hal import Cell, cell_from_yaml, execute_grasp
from hal.errors import OutOfWorkspace
from hal.replay import ReplayArm, ReplayArmConfig, recorded_cell
from hal.testing import ArmContract, at_home
from hal.testing.arm_contract import STILL_M, STILL_RAD, joints_at_rest, over_the_table
from mskgrasp.core.geometry import Pose, quat_multiply
from mskgrasp.core.grasp import Grasp
from tests.hal.franka.robots import robot_for, write_cell
from tests.hal.replay.toy import toy_cell
from tests.hal_contract.conftest import CELLS

STOP_AFTER_S = {"sapien": 0.02, "mujoco": 0.02}
"""Motions of a simulated arm take less time than those of a real one."""


def backend(name: str, folder: Path) -> AbstractContextManager[Path]:
    """The file of a cell with an arm of that backend, which has something to talk to."""

    @contextmanager
    def serve() -> Iterator[Path]:
        if name in STOP_AFTER_S:
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


@pytest.fixture(params=[*STOP_AFTER_S, "franky", PANDA_PY, "replay"], scope="module")
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def world(name: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """A cell whose arm is connected; where it will be recorded, the camera keeps the simulation going."""
    with backend("sapien" if name == "replay" else name, tmp_path_factory.mktemp(name)) as path:
        cell = cell_from_yaml(path)
        with cell.camera if name == "replay" else cell.arm:
            yield cell


def rehearse(request: pytest.FixtureRequest, recorded: Cell) -> None:
    """Runs the test that asks for a replay on the recorded cell."""
    callspec = request.node.callspec.params
    given = {**callspec, "cell": recorded, "name": "sapien", "stop_after_s": STOP_AFTER_S["sapien"]}
    wanted = inspect.signature(request.function).parameters
    request.function(**{key: given[key] if key in given else request.getfixturevalue(key) for key in wanted})


class TestArm(ArmContract):
    @pytest.fixture
    def stop_after_s(self, name: str) -> float | None:
        return None if name == "replay" else STOP_AFTER_S.get(name, 0.3)

    @pytest.fixture
    def fresh_cell(self, name: str, tmp_path: Path) -> Iterator[Cell]:
        with backend(name, tmp_path) as path:
            yield cell_from_yaml(path)

    @pytest.fixture
    def cell(self, world: Cell, name: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Cell]:
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

    def test_the_hand_at_home_points_down_over_the_table(self, cell: Cell):
        """The Panda's ready pose by its documentation: 0.307 m in front, 0.487 m up, the hand down."""
        pose = cell.arm.state().T_base_tcp
        assert pose.position == pytest.approx([0.307, 0.0, 0.487], abs=5e-3)
        assert abs(pose.quat_wxyz[1]) == pytest.approx(1.0, abs=1e-3)

    @pytest.mark.parametrize("name", ["franky", PANDA_PY], indirect=True, scope="module")
    def test_a_straight_motion_is_straight(self, cell: Cell):
        """Measured on the way, from another thread, while the arm moves; SAPIEN's has its own test."""
        begin, target = cell.arm.state().T_base_tcp.position, over_the_table(cell)
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

    def test_a_line_that_leaves_the_reach_on_its_way_is_refused(self, cell: Cell):
        """Both ends are reachable; the arm would have to turn by more than a joint's range."""
        arm = cell.arm
        arm.move_to_joints(np.array([0.0, 0.0, 0.0, -2.2, 0.0, 2.2, -2.2]), speed=0.8)
        joints_at_rest(arm)
        here = arm.state()
        target = Pose(
            position=here.T_base_tcp.position,
            quat_wxyz=quat_multiply(
                np.array([np.cos(0.8), 0.0, 0.0, np.sin(0.8)]), here.T_base_tcp.quat_wxyz
            ),
        )
        with pytest.raises(OutOfWorkspace, match="no straight line"):
            arm.move_to_pose(target)
        assert arm.state().joints == pytest.approx(here.joints, abs=STILL_RAD)
        arm.move_gripper(0.07)

    def test_a_grasp_out_of_reach_is_refused_before_anything_moves(self, cell: Cell):
        before = cell.arm.state()
        with pytest.raises(OutOfWorkspace, match="reach"):
            execute_grasp(cell, Grasp.from_vector(np.array([0.74, 0.39, 0.02, 0.0])))
        after = cell.arm.state()
        assert after.joints == pytest.approx(before.joints, abs=STILL_RAD)
        assert after.gripper_width == pytest.approx(before.gripper_width, abs=STILL_M)

    def test_joints_that_bring_the_hand_into_the_table_are_refused(self, cell: Cell):
        with pytest.raises(OutOfWorkspace, match="workspace|table"):
            cell.arm.move_to_joints(np.array([0.0, 0.9, 0.0, -1.9, 0.0, 2.8, 0.785]))
