"""The arm's kinematics: closed form, derivative, limits, and tracking of poses."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import (
    HOME,
    JOINT_LOWER,
    JOINT_UPPER,
    forward,
    forward_pose,
    reachable,
    top_down,
    track,
    within_limits,
)

coordinate = dict(allow_nan=False, allow_infinity=False)


@given(
    x=st.floats(0.35, 0.65, **coordinate),
    y=st.floats(-0.15, 0.15, **coordinate),
    z=st.floats(0.0105, 0.3, **coordinate),
    theta=st.floats(-math.pi / 2, math.pi / 2, exclude_max=True, **coordinate),
)
def test_the_closed_form_puts_the_tcp_at_the_grasp(x, y, z, theta):
    grasp = np.array([x, y, z, theta])
    joints, reachable = top_down(torch.as_tensor(grasp))
    assert bool(reachable)
    assert forward(joints)[0].numpy() == pytest.approx(pose_base_tcp(grasp).as_matrix(), abs=1e-9)


def test_what_the_arm_cannot_reach_is_reported():
    assert not bool(top_down(torch.tensor([1.2, 0.0, 0.1, 0.0], dtype=torch.float64))[1])
    assert not bool(top_down(torch.tensor([0.15, 0.0, 0.05, 0.0], dtype=torch.float64))[1])


def test_the_jacobian_is_the_derivative_of_the_pose():
    joints = torch.tensor(HOME, dtype=torch.float64) + 0.1
    jacobian = forward(joints)[1]
    numeric = torch.autograd.functional.jacobian(lambda q: forward(q)[0][:3, 3], joints)
    assert jacobian[:3].numpy() == pytest.approx(numeric.numpy(), abs=1e-12)


def test_tracking_follows_tilted_poses():
    start = torch.tensor(HOME, dtype=torch.float64)
    pose = forward(start)[0]
    path = []
    for k in range(1, 11):
        turn = torch.linalg.matrix_exp(
            torch.tensor([[0, 0, 1.0], [0, 0, 0], [-1, 0, 0]], dtype=torch.float64) * 0.03 * k
        )
        target = pose.clone()
        target[:3, :3] = turn @ pose[:3, :3]
        target[2, 3] += 0.01 * k
        path.append(target)
    joints, error = track(torch.stack(path), start)
    assert float(error.max()) < 1e-6
    assert forward(joints)[0].numpy() == pytest.approx(torch.stack(path).numpy(), abs=1e-6)


def test_numpy_joints_need_no_torch():
    program = (
        "import sys, numpy\n"
        "from mskgrasp.core.panda_kinematics import HOME, forward, track\n"
        "joints = numpy.array(HOME)\n"
        "track(forward(joints)[0][None], joints + 0.01)\n"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_at_home_the_hand_is_where_the_links_lengths_put_it():
    """Joints 3 and 5 are zero: a planar chain of the lengths in Franka's documentation, summed by hand."""
    q2, q4, q6 = HOME[1], HOME[3], HOME[5]
    shoulder = np.array([0.0, 0.333])
    along, across = np.array([math.sin(q2), math.cos(q2)]), np.array([math.cos(q2), -math.sin(q2)])
    elbow = shoulder + 0.316 * along + 0.0825 * across
    bent = q2 - q4
    along, across = np.array([math.sin(bent), math.cos(bent)]), np.array([math.cos(bent), -math.sin(bent)])
    wrist = elbow - 0.0825 * across + 0.384 * along
    assert bent - q6 == pytest.approx(0)  # so the hand points straight down
    hand = wrist + np.array([0.088, -0.107 - 0.1034])
    pose = forward_pose(np.array(HOME))
    assert pose.position == pytest.approx([hand[0], 0.0, hand[1]])
    assert pose.as_matrix()[:3, 2] == pytest.approx([0, 0, -1], abs=1e-12)


def test_a_joint_beyond_its_limit_and_a_pose_beyond_the_arm_are_out_of_reach():
    lower, upper = np.array(JOINT_LOWER), np.array(JOINT_UPPER)
    home = forward_pose(np.array(HOME))
    assert within_limits(np.array(HOME), lower, upper) and reachable(home, lower, upper)
    beyond = np.array(HOME)
    beyond[3] = 0.0
    assert not within_limits(np.stack([HOME, beyond]), lower, upper)
    far = Pose(position=np.array([1.0, 0.0, 0.5]), quat_wxyz=home.quat_wxyz)
    assert not reachable(far, lower, upper)
    # Within the arm's length, and not within joints that are held at home.
    aside = Pose(position=home.position + [0.0, 0.1, 0.0], quat_wxyz=home.quat_wxyz)
    assert reachable(aside, lower, upper)
    assert not reachable(aside, np.array(HOME) - 1e-3, np.array(HOME) + 1e-3)
