from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.grasp import TABLE_CLEARANCE, lowest_grasp_z
from tasks.motion import PEAK_ACCELERATION, ease, ease_duration


@pytest.mark.parametrize(("distance", "speed"), [(0.01, 0.25), (0.06, 0.25), (0.3, 0.25), (0.02, 1.0)])
def test_a_path_passes_neither_its_speed_nor_its_acceleration(distance, speed):
    seconds = ease_duration(distance, speed, PEAK_ACCELERATION)
    n = 2000
    way = distance * np.concatenate([[0.0], ease(n, torch.device("cpu")).numpy()])
    velocity = np.diff(way) * n / seconds
    acceleration = np.diff(velocity) * n / seconds
    assert way[-1] == pytest.approx(distance)
    assert velocity.max() <= speed * 1.001
    assert np.abs(acceleration).max() <= PEAK_ACCELERATION * 1.01
    # One of the bounds is reached: the path is not slower than it must be.
    assert velocity.max() > speed * 0.99 or np.abs(acceleration).max() > PEAK_ACCELERATION * 0.99


@pytest.mark.parametrize("depth", [0.005, 0.02, 0.06, 0.15])
@pytest.mark.parametrize("place", [(0.4, -0.1), (0.5, 0.0), (0.6, 0.1)])
def test_a_descent_overshoots_by_less_than_half_the_table_clearance(env, boxes, depth, place):
    far = np.array([[0.5, -0.5, 0.015, 1, 0, 0, 0]])
    env.reset(seed=0, options=dict(parts=[str(boxes["light"].folder)], reconfigure=True, pose_base_obj=far))
    goal = torch.tensor([[*place, lowest_grasp_z(0.0) + 0.05, 0.5]])
    start = goal + torch.tensor([0.0, 0.0, depth, 0.0])
    path = env.attempt._line(start, goal, env.physics.descend_speed)
    env.motion.place(path[0])
    env.motion.step(20)
    heights = []
    env.motion.follow(
        path, check=lambda _: heights.append(float(env.tcp_pose().position[0, 2])), check_every=1
    )
    for _ in range(60):
        env.motion.step()
        heights.append(float(env.tcp_pose().position[0, 2]))
    assert float(goal[0, 2]) - min(heights) < TABLE_CLEARANCE / 2
    assert heights[-1] == pytest.approx(float(goal[0, 2]), abs=1e-4)
