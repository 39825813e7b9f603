from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.panda_kinematics import HOME, forward


def test_forward_kinematics_are_those_of_the_simulated_arm(env):
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        joints = torch.tensor(HOME, dtype=torch.float64) + 0.4 * (torch.rand(7, generator=generator) - 0.5)
        env.motion.place(joints[None])
        tcp = env.tcp_pose()
        expected = forward(joints)[0].numpy()
        assert tcp.position[0].numpy() == pytest.approx(expected[:3, 3], abs=2e-6)
        assert np.abs(tcp.as_matrix()[0, :3, :3] - expected[:3, :3]).max() < 2e-6
