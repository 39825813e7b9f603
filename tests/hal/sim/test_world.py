"""The world of the simulated cell: a block whose height and room beside it are known."""

from __future__ import annotations

import numpy as np
import pytest
import sapien
from sapien.physx import PhysxRigidDynamicComponent

from hal.config import TableError
from hal.errors import NotConnected
from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.world import SapienWorld
from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import pose_distance, quat_about_z
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.parts import Part
from tasks.scene.frames import to_world


def put(world: SapienWorld, x: float, y: float, turn: float = 0.0) -> None:
    """Upright, 3 cm high."""
    pose = sapien.Pose(p=to_world(np.array([x, y, 0.015])), q=quat_about_z(np.array(turn)))
    world.env.part.set_pose(pose)


def test_a_world_lives_from_its_first_user_to_its_last(block: Part):
    world = sapien_cell(SapienCellConfig(type="sapien", part=str(block.folder))).feeder
    assert isinstance(world, SapienWorld)
    for use in (lambda: world.env, world.part_pose, world.top):
        with pytest.raises(NotConnected, match="the simulated cell is closed"):
            use()
    world.open()
    first = world.env
    world.open()
    assert world.env is first
    world.close()
    assert world.env is first
    world.close()
    world.close()
    with pytest.raises(NotConnected):
        world.part_pose()


def test_a_seed_places_a_part_independently_of_the_one_before(block_world: SapienWorld, block: Part):
    poses, before = [], block_world.presented
    for part, seed in ((str(block.folder), 4), ("washer_m36", 5), (str(block.folder), 4)):
        block_world.present(part, seed)
        poses.append(block_world.part_pose())
        assert block_world.presented_seed == seed
    assert block_world.presented == before + 3
    assert np.array_equal(poses[0].as_vector(), poses[2].as_vector())
    x_min, x_max, y_min, y_max = block_world.region
    for pose in poses:
        assert x_min <= pose.position[0] <= x_max and y_min <= pose.position[1] <= y_max
        assert np.linalg.norm(pose.quat_wxyz) == pytest.approx(1, abs=1e-5)


def test_an_unknown_part_is_refused_and_the_table_stays_as_it_is(block_world: SapienWorld, block: Part):
    block_world.present(str(block.folder), 1)
    before = block_world.part_pose().as_vector()
    with pytest.raises(BadPart, match="no_such_part"):
        block_world.present("no_such_part", 2)
    assert np.array_equal(block_world.part_pose().as_vector(), before)
    assert block_world.presented_seed == 1


@pytest.fixture
def world(block_world: SapienWorld, block: Part) -> SapienWorld:
    """The block upright in the middle."""
    block_world.present(str(block.folder), 0)
    put(block_world, 0.5, 0.0)
    return block_world


def test_the_pose_of_a_part_and_the_height_of_the_highest_are_in_the_base_frame(world: SapienWorld):
    put(world, 0.47, -0.05, 0.6)
    pose = world.part_pose()
    assert pose.position == pytest.approx([0.47, -0.05, 0.015], abs=1e-6)
    assert pose.quat_wxyz == pytest.approx([np.cos(0.3), 0, 0, np.sin(0.3)], abs=1e-6)
    assert world.top() == pytest.approx(0.03, abs=1e-6)
    # On edge: half the diagonal of 4 x 3 cm above and below its middle.
    lean = np.arctan2(0.04, 0.03)
    edge = sapien.Pose(p=to_world(np.array([0.5, 0, 0.1])), q=[np.cos(lean / 2), 0, np.sin(lean / 2), 0])
    world.env.part.set_pose(edge)
    assert world.top() == pytest.approx(0.125, abs=1e-6)


def test_what_stands_between_the_open_pads(world: SapienWorld):
    for *grasp, reach in (
        (0.5, 0.0, 0.02, 0.0, 0.010),  # half of its 2 cm
        (0.5, 0.004, 0.02, 0.0, 0.014),
        (0.5, 0.0, 0.02, np.pi / 2 - 1e-9, 0.020),  # across: half of its 4 cm
        (0.5, 0.045, 0.02, 0.0, None),  # a finger would be inside it
        (0.5, 0.15, 0.02, 0.0, None),  # nothing between the pads
        (0.5, 0.0, 0.1, 0.0, None),  # above it
    ):
        found = world.reach(pose_base_tcp(np.array(grasp)))
        assert found == (None if reach is None else pytest.approx(reach, abs=1e-5)), grasp


def test_what_lies_beside_the_region_counts_for_height_and_room(world: SapienWorld, block: Part):
    put(world, 0.45, 0.25)
    world.present(str(block.folder), 0, keep=True)
    world.env.part.set_pose(sapien.Pose(p=to_world(np.array([0.5, 0.0, -1.0]))))
    assert world.top() == world.top_beside() == pytest.approx(0.03, abs=1e-4)
    assert world.reach(pose_base_tcp(np.array([0.45, 0.25, 0.02, 0.0]))) == pytest.approx(0.010, abs=1e-4)
    world.present(str(block.folder), 0)
    assert world.reach(pose_base_tcp(np.array([0.45, 0.25, 0.02, 0.0]))) is None


def test_a_part_lies_on_a_table_with_an_error(block: Part):
    """3 mm higher, and by the slope more or less where the part lies."""
    poses, tops = [], []
    for error in (TableError(), TableError(height=0.003, slope=(0.01, 0.0))):
        config = SapienCellConfig(type="sapien", part=str(block.folder), table_error=error)
        cell = sapien_cell(config)
        with cell.arm:
            assert isinstance(cell.tracker, SapienWorld)
            poses.append(cell.tracker.part_pose())
            tops.append(cell.tracker.top_beside())
    assert np.diff(tops)[0] == pytest.approx(0.003 + 0.01 * (0.75 - 0.5), abs=1e-5)
    level, moved = poses
    rise = 0.003 + 0.01 * (moved.position[0] - 0.5)
    assert moved.position[2] - level.position[2] == pytest.approx(rise, abs=2e-4)
    assert pose_distance(level, moved)[1] == pytest.approx(0.01, abs=2e-3)


def test_a_part_at_rest_stays_where_it_is_while_the_arm_is_far_and_a_falling_one_falls(
    world: SapienWorld, block: Part
):
    put(world, 0.5, 0.0)
    before = world.part_pose()
    body = world.env.part._objs[0]
    with world.parts_kept_still():
        # A push that would move it.
        rigid = body.find_component_by_type(PhysxRigidDynamicComponent)
        assert isinstance(rigid, PhysxRigidDynamicComponent)
        rigid.add_force_torque([5.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        world.env.motion.step(20)
    distance, angle = pose_distance(before, world.part_pose())
    assert distance < 1e-6 and angle < 1e-5
    world.env.motion.step(50)
    assert pose_distance(before, world.part_pose())[0] < 1e-4  # and keeps no speed
    body.set_pose(sapien.Pose(p=to_world(np.array([0.5, 0.0, 0.1]))))
    world.env.motion.step(10)
    with world.parts_kept_still():
        world.env.motion.step(world.env.motion.n_steps(0.5))
    assert world.part_pose().position[2] == pytest.approx(0.015, abs=1e-3)
