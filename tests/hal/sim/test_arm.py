"""The simulated arm skips what need not be simulated, and nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import sapien
import torch
from scipy.spatial.transform import Rotation

import hal.sim.arm
from hal import Cell, execute_grasp, go_home, put_down
from hal.execute import RELEASE
from hal.limits import lowest_point
from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.arm import SapienArm, is_vertical
from hal.sim.world import SapienWorld
from mskgrasp.core.geometry import pose_distance
from mskgrasp.core.grasp import PAD_REACH, Grasp
from mskgrasp.core.panda_kinematics import HOME, forward_pose
from tests.hal.watching import check_watching


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    with sapien_cell(SapienCellConfig(type="sapien")).connected() as cell:
        yield cell


@pytest.mark.parametrize(
    ("part", "offset"),
    [pytest.param("hex_nut_m30", (0.004, 0.003), marks=pytest.mark.slow), ("hinge_60x30", (0.0, 0.004))],
)
def test_long_steps_leave_a_part_in_the_hand_and_on_the_table_as_short_ones_do(
    cell: Cell, monkeypatch, part: str, offset: tuple[float, float]
):
    assert isinstance(cell.feeder, SapienWorld) and cell.tracker is not None
    steps, hands, placed = [], [], []
    for far in (True, False):
        if not far:
            for gap in ("AIR_GAP", "PAD_GAP", "TABLE_GAP"):
                monkeypatch.setattr(hal.sim.arm, gap, np.inf)
        cell.feeder.present(part, 1)
        top, made = cell.feeder.top(), _recorded_steps(cell, monkeypatch)
        before = cell.tracker.part_pose().position
        grasp = Grasp.from_vector(np.array([before[0] + offset[0], before[1] + offset[1], 0.0115, 0.3]))
        result = execute_grasp(cell, grasp)
        assert result.holding
        descent = len(made)
        hands.append(result.T_base_tcp.inverse() @ cell.tracker.part_pose())
        put_down(cell, grasp, opening=result.width + RELEASE)
        placed.append(cell.tracker.part_pose())
        steps.append(len(made))
        if far:  # past the part, but not near the table; on the way down to the hinge a finger meets it
            for way in (made[:descent], made[descent:])[part == "hinge_60x30" :]:
                heights = [
                    height
                    for (_, last), (rate, height) in pairwise(way)
                    if rate == hal.sim.arm.AIR_HZ and height < top and abs(height - last) > 1e-4
                ]
                assert len(heights) > 5 and min(heights) > 0.0058
        go_home(cell)
    assert steps[0] < 0.65 * steps[1]
    for coarse, fine in (hands, placed):
        moved, turned = pose_distance(coarse, fine)
        assert moved < 0.2e-3 and np.degrees(turned) < 0.3


def _recorded_steps(cell: Cell, monkeypatch) -> list[tuple[int, float]]:
    """A list that gets rate and height of the pads, m, at each further step of the present simulation."""
    made: list[tuple[int, float]] = []
    assert isinstance(cell.feeder, SapienWorld)
    motion = cell.feeder.env.motion
    step = motion.step

    def recorded(n_steps: int = 1) -> None:
        height = float(cell.arm.state().T_base_tcp.position[2]) - PAD_REACH
        made.extend([(motion.rate_hz, height)] * n_steps)
        step(n_steps)

    monkeypatch.setattr(motion, "step", recorded)
    return made


def test_a_tilted_hand_is_in_the_air_only_above_its_lowest_corner():
    joints = torch.tensor(HOME, dtype=torch.float64)[None].repeat(2, 1)
    joints[1, 5] += 0.5  # tilts the hand
    for row in joints:
        lowest = lowest_point(forward_pose(row.numpy()))
        for gap, clear in ((-1e-4, True), (1e-4, False)):
            top = lowest - hal.sim.arm.AIR_GAP + gap
            world = SimpleNamespace(top=lambda top=top: top, reach=lambda pose: None)
            arm = SimpleNamespace(_force=0.0, _world=world)
            assert SapienArm._clear(arm, row[None]).tolist() == [clear]  # pyright: ignore


def test_while_a_part_falls_or_one_beside_moves_all_steps_are_short(cell: Cell, monkeypatch):
    assert isinstance(cell.feeder, SapienWorld)
    world, fine = cell.feeder, {cell.feeder.physics.rate_hz}
    world.present("hex_nut_m30", 1)
    x, y = world.part_pose().position[:2]
    world.env.part.set_pose(sapien.Pose(world.env.part.pose.sp.p - np.array([x - 0.45, y + 0.25, 0.0])))
    world.present("hex_nut_m20", 2, keep=True)
    made = _recorded_steps(cell, monkeypatch)
    cell.arm.wait(0.1)
    assert {rate for rate, _ in made} == {hal.sim.arm.AIR_HZ}
    (beside,) = (body for name, body in world.env.scene.actors.items() if "beside" in name)
    for body in (world.env.part, beside):
        pose = body.pose.sp
        body.set_pose(sapien.Pose(pose.p + [0.0, 0.0, 0.02], pose.q))
        world.env.motion.step(3)
        assert not world.at_rest()
        made.clear()
        cell.arm.wait(0.1)
        assert {rate for rate, _ in made} == fine
        cell.arm.wait(0.1)
        assert world.at_rest()


def test_pads_that_press_let_go_at_once_and_the_part_is_at_rest_when_it_is_free(cell: Cell):
    assert isinstance(cell.feeder, SapienWorld)
    world = cell.feeder
    world.present("hex_nut_m30", 1)
    x, y, _ = world.part_pose().position
    first = execute_grasp(cell, Grasp.from_vector(np.array([x, y, 0.0115, 0.3])))
    held_until = world.env.motion.seconds
    assert first.holding and not world.at_rest()
    cell.arm.move_gripper(first.width + 0.004)
    # 2 mm a finger, the pads' own way back out of what they pressed, and the time to see that they stand.
    assert world.env.motion.seconds - held_until < 0.04 + 0.1 + 0.1
    cell.arm.move_gripper(0.08)
    go_home(cell)


def test_a_hand_moves_straight_down_only_if_it_points_down():
    def poses(*changes: tuple[float, float, float]) -> np.ndarray:
        made = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(changes) + 1, 1, 1))
        made[:, 2, 3] = np.linspace(0.2, 0.1, len(made))
        for pose, (aside, turn, tilt) in zip(made[1:], changes, strict=True):
            pose[0, 3] = aside
            pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("zx", [turn, tilt]).as_matrix()
        return made

    straight = (0.0, 0.0, 0.0)
    assert is_vertical(poses(straight, straight))
    for other in ((0.001, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01)):
        assert not is_vertical(poses(straight, other))
    leaning = poses(straight)
    leaning[:, :3, :3] = leaning[:, :3, :3] @ Rotation.from_euler("x", 0.1).as_matrix()
    assert not is_vertical(leaning)


def test_a_second_grasp_presses_harder_and_does_not_drop_the_part(cell: Cell):
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("hex_nut_m30", 1)
    x, y, _ = cell.tracker.part_pose().position
    first = execute_grasp(cell, Grasp.from_vector(np.array([x, y, 0.0115, 0.3])))
    aloft = cell.tracker.part_pose()
    again = cell.arm.grasp(45.0)
    assert first.holding and again.holding and again.width == pytest.approx(first.width, abs=2e-4)
    moved, turned = pose_distance(aloft, cell.tracker.part_pose())
    assert moved < 0.2e-3 and np.degrees(turned) < 0.3
    cell.arm.move_gripper(0.08)
    go_home(cell)


def test_who_watches_a_motion_sees_the_arm_on_its_way_and_nothing_afterwards(cell: Cell):
    check_watching(cell)
