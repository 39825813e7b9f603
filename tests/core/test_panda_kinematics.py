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

from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import HOME, forward, top_down, track

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
