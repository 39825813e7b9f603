"""World, camera and arm of every simulated cell: a world lives as long as a device uses it."""

from __future__ import annotations

import numpy as np
import pytest

from hal.config import READY
from hal.errors import NotConnected
from hal.simulated import PEAK_ACCELERATION, SimulatedArm, SimulatedCamera, SimulatedWorld, panda_limits
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import REGION, Overhead
from mskgrasp.parts import Part
from tasks.robot import motion


class ToyWorld(SimulatedWorld):
    """Counts how often it is built and freed, and keeps the seeds of the places of parts."""

    built = freed = 0
    seeds: tuple[int, ...] = ()

    def _place(self, part: Part, seed: int, keep: bool) -> None:
        self.seeds += (seed,)

    def part_pose(self) -> Pose:
        pytest.fail("no pose is asked for")

    def _build(self) -> None:
        self.built += 1

    def _free(self) -> None:
        self.freed += 1


class ToyCamera(SimulatedCamera[ToyWorld]):
    serial = "toy"

    def _render(self) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        return np.zeros((4, 4, 3), np.uint8), np.ones((4, 4)), None


class ToyArm(SimulatedArm[ToyWorld]):
    def _nothing(self, *_: object) -> None:
        pytest.fail("no motion is asked for")

    _state = _move_to_joints = _move_to_pose = _move_until_contact = _move_gripper = _grasp = _wait = (
        _recover
    ) = _nothing  # type: ignore[assignment]


def make_world() -> ToyWorld:
    return ToyWorld(overhead=Overhead(), region=REGION, home=np.array(READY), part="none", seed=0)


def test_the_first_device_builds_the_world_and_the_last_one_frees_it():
    world = make_world()
    camera, arm = ToyCamera(world), ToyArm(world, panda_limits())
    with camera:
        with arm:
            arm.connect()
            assert (world.built, world.freed) == (1, 0)
        arm.close()
        assert world.freed == 0
        assert camera.capture().serial == "toy"
    assert (world.built, world.freed) == (1, 1)
    with arm:
        assert (world.built, world.freed) == (2, 1)


def test_a_camera_outside_its_context_names_itself():
    with pytest.raises(NotConnected, match="ToyCamera is not connected"):
        ToyCamera(make_world()).capture()


def test_the_hand_accelerates_as_in_simulated_attempts():
    assert PEAK_ACCELERATION == motion.PEAK_ACCELERATION


def test_seeds_that_simulators_could_not_take_become_others():
    world = make_world()
    for seed in (7, 2**32 - 1, 2**32, 2**32 + 7, 2**63 - 1):
        world.present("hex_nut_m30", seed)
        assert world.presented_seed == seed
    assert world.seeds[:2] == (7, 2**32 - 1)
    assert len(set(world.seeds)) == 5 and max(world.seeds) < 2**32


def test_a_world_calls_the_function_that_an_arm_was_given():
    world, calls = make_world(), []
    world.call_watch()
    arm = ToyArm(world, panda_limits())
    arm.watch(lambda: calls.append(1))
    world.call_watch()
    arm.watch(None)
    world.call_watch()
    assert calls == [1]
