"""Kinematics, limits and messages of the Franka arms, without a robot."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hal.franka import PandaPyArmConfig
from hal.franka.faults import explain
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import forward, reachable, track

HOME = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
PANDA = PandaPyArmConfig(driver="panda_py", host="x")
LOWER, UPPER = PANDA.joint_lower(), PANDA.joint_upper()
shares = st.lists(st.floats(0, 1), min_size=7, max_size=7)


@settings(deadline=None, max_examples=50)
@given(shares)
def test_numpy_arrays_and_torch_tensors_give_the_same_kinematics(share: list[float]):
    joints = LOWER + np.array(share) * (UPPER - LOWER)
    pose, jacobian = forward(joints)
    expected, expected_jacobian = forward(torch.tensor(joints))
    assert pose == pytest.approx(expected.numpy(), abs=1e-12)
    assert jacobian == pytest.approx(expected_jacobian.numpy(), abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(shares)
def test_track_finds_joints_that_put_the_hand_back(share: list[float]):
    joints = HOME + 0.2 * (np.array(share) - 0.5)
    found, error = track(forward(joints)[0][None], HOME, iterations=20)
    assert error[0] < 1e-4
    assert forward(found[0])[0] == pytest.approx(forward(joints)[0], abs=2e-4)


def test_reach_ends_where_the_arm_does():
    assert reachable(pose_base_tcp(np.array([0.5, 0.1, 0.02, 0.5])), LOWER, UPPER)
    assert not reachable(pose_base_tcp(np.array([0.9, 0.3, 0.02, 0.0])), LOWER, UPPER)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("libfranka: Connection to FCI refused. Please install FCI feature.", "NotConnected"),
        ("libfranka: Connection error: Host not found", "NotConnected"),
        ("libfranka: UDP receive: Timeout", "CommunicationLost"),
        ("libfranka: server closed connection", "CommunicationLost"),
        ('libfranka: Move command aborted: motion aborted by reflex! ["cartesian_reflex"]', "MotionAborted"),
        ("libfranka: Move command preempted!", "MotionAborted"),
        (
            'libfranka: Set Load command rejected: command not possible in the current mode ("Reflex")!',
            "MotionAborted",
        ),
        ("Motion planner failed with error code -110", "NoTrajectory"),
        ("libfranka gripper: Command failed!", "MotionAborted"),
    ],
)  # fmt: skip
def test_a_vendors_text_has_one_meaning(text: str, kind: str):
    """The texts of libfranka 0.9.2 and 0.21.2, which both wrappers raise as plain RuntimeError at times."""
    error = explain(RuntimeError(text), "panda_py", "robot")
    assert type(error).__name__ == kind
    assert "\n" not in str(error)


def test_neither_vendor_nor_simulator_is_imported_before_an_arm_connects():
    code = (
        "import sys\n"
        "for name in ('franky', 'panda_py', 'sapien', 'mani_skill', 'torch'): sys.modules[name] = None\n"
        "import hal, hal.devices, hal.franka, hal.franka.worker, hal.franka.franky_driver\n"
        "import hal.franka.panda_py_driver\n"
        "from hal.limits import ArmLimits\n"
        "hal.franka.FrankaArm(hal.franka.FrankyArmConfig(driver='franky', host='x'), None)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
