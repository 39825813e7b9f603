"""Base frame, ManiSkill's world, and the cameras of both."""

from __future__ import annotations

import numpy as np
import pytest
import sapien
import torch
from mani_skill.utils import sapien_utils
from scipy.spatial.transform import Rotation

from mskgrasp.core.geometry import Pose
from tasks.scene.arrays import arrays_for
from tasks.scene.frames import base_pose, own_pose, sapien_camera_pose, to_base, to_world


@pytest.mark.parametrize("shape", [(3,), (5, 3), (2, 4, 3)])
def test_a_position_goes_to_the_world_and_back_in_its_own_kind(shape: tuple[int, ...]):
    positions = np.random.default_rng(0).uniform(-1, 1, shape)
    for kind in (positions, torch.as_tensor(positions), torch.as_tensor(positions, dtype=torch.float32)):
        world = to_world(kind)
        assert type(world) is type(kind) and world.dtype == kind.dtype and world.shape == shape
        np.testing.assert_allclose(
            np.asarray(world - kind), np.broadcast_to([-0.615, 0, 0], shape), atol=1e-6
        )
        np.testing.assert_allclose(np.asarray(to_base(world)), np.asarray(kind), atol=1e-6)


def test_no_argument_is_changed():
    position = torch.zeros(3)
    to_world(position)
    to_base(position)
    assert not position.any()


def test_the_simulated_robot_stands_at_the_origin_of_the_base(env):
    pose = base_pose(env.agent.robot.links_map["panda_link0"])
    assert pose.position[0].tolist() == pytest.approx([0, 0, 0], abs=1e-6)
    assert pose.quat_wxyz[0].tolist() == pytest.approx([1, 0, 0, 0], abs=1e-6)


def test_one_sub_scene_is_read_as_maniskill_reads_it(env, place):
    """Numpy without ManiSkill's tensors: for a body and for a link."""
    place("light")
    env.part.set_pose(sapien.Pose(p=to_world(np.array([0.4, 0.1, 0.2])), q=[0.5, 0.5, -0.5, 0.5]))
    for body in (env.part, env.agent.tcp):
        own = own_pose(body, arrays_for(env.scene))
        assert isinstance(own.position, np.ndarray) and own.position.shape == (1, 3)
        np.testing.assert_allclose(own.position, to_base(body.pose.p).numpy(), atol=1e-6)
        np.testing.assert_allclose(own.quat_wxyz, body.pose.q.numpy(), atol=1e-6)
    tensors = base_pose(env.part)
    assert torch.is_tensor(tensors.position) and tensors.position.dtype == torch.float32
    assert tensors.position[0].tolist() == pytest.approx([0.4, 0.1, 0.2], abs=1e-6)


def test_a_camera_looks_where_its_optical_axis_points():
    """SAPIEN: x forward, y left, z up. Straight down, the image's top away from the base."""
    optical = np.eye(4)
    optical[:3, :3] = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]])  # columns: right, down, forward
    optical[:3, 3] = 0.5, 0.1, 0.8
    matrix = sapien_camera_pose(Pose.from_matrix(optical)).to_transformation_matrix()
    assert matrix[:3, 0] == pytest.approx([0, 0, -1], abs=1e-6)  # forward is down
    assert matrix[:3, 1] == pytest.approx([0, 1, 0], abs=1e-6)  # left is +y
    assert matrix[:3, 2] == pytest.approx([1, 0, 0], abs=1e-6)  # up in the image is away from the base
    assert matrix[:3, 3] == pytest.approx([0.5 - 0.615, 0.1, 0.8], abs=1e-6)


def test_a_camera_is_where_maniskills_own_look_at_puts_it():
    rng = np.random.default_rng(0)
    for _ in range(10):
        eye, target = (
            rng.uniform([0.2, -0.5, 0.5], [0.8, 0.5, 1.0]),
            rng.uniform([0.4, -0.1, 0], [0.6, 0.1, 0.1]),
        )
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        optical = np.eye(4)
        optical[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
        optical[:3, 3] = eye
        ours = sapien_camera_pose(Pose.from_matrix(optical))
        theirs = sapien_utils.look_at(to_world(eye), to_world(target)).sp
        turn = Rotation.from_quat(ours.q, scalar_first=True).inv() * Rotation.from_quat(
            theirs.q, scalar_first=True
        )
        assert turn.magnitude() < 1e-3
        assert ours.p == pytest.approx(theirs.p, abs=1e-6)
