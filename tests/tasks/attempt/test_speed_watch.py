"""The greatest speed of a part, on motions whose speed is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sapien
import torch

from tasks.attempt.speed_watch import SpeedWatch
from tasks.scene.arrays import Arrays, arrays_for
from tasks.scene.frames import to_world

G = 9.81
TENSORS = Arrays(torch.device("cpu"))


def lift(env, height: float) -> None:
    position = to_world(np.array([0.5, -0.5, height]))
    env.part.set_pose(sapien.Pose(p=position))
    env.part.set_linear_velocity(torch.zeros(1, 3))
    env.part.set_angular_velocity(torch.zeros(1, 3))


def test_a_falling_part_is_as_fast_as_free_fall_makes_it(env, place):
    """After 0.2 s it falls with 1.96 m/s; over the last 4 ms it had 1.94 m/s on the mean."""
    place("light")
    lift(env, 0.5)
    watch = SpeedWatch(env.part, arrays_for(env.scene))
    seconds, every = 0.0, 4
    watch.start(seconds)
    for _ in range(50):
        env.motion.step(every)
        seconds += every / env.motion.rate_hz
        watch.update(seconds)
    (fastest,) = watch.fastest()
    assert fastest.dtype == np.float32
    assert fastest == pytest.approx(G * (0.2 - 0.002), rel=0.01)
    # Slower again, the greatest speed stays; begun anew, it is forgotten.
    lift(env, 0.5)
    watch.start(seconds)
    assert watch.fastest() == [0]
    env.motion.step(every)
    watch.update(seconds + 0.004)
    assert float(watch.fastest()[0]) < 0.05


def test_two_looks_at_the_same_time_are_one(env, place):
    """No time has passed: a speed would be infinite."""
    place("light")
    watch = SpeedWatch(env.part, arrays_for(env.scene))
    watch.start(1.0)
    lift(env, 0.4)
    watch.update(1.0)
    assert watch.fastest() == [0]
    watch.update(1.1)  # it has not moved since
    assert watch.fastest() == [0]


class Sliding:
    """Parts of several sub-scenes, as where PhysX runs on a GPU."""

    def __init__(self, n: int):
        self.scene = SimpleNamespace(gpu_sim_enabled=True)
        self.p = torch.zeros(n, 3)

    @property
    def pose(self) -> SimpleNamespace:
        return SimpleNamespace(p=self.p)


def test_each_sub_scene_has_its_own_greatest_speed():
    """Over 0.1 s: 3 cm, then 1 cm; none, then 5 cm in two axes; none at all."""
    parts: Any = Sliding(3)
    watch = SpeedWatch(parts, TENSORS)
    watch.start(2.0)
    for seconds, moves in (
        (2.1, [[0.03, 0, 0], [0, 0, 0], [0, 0, 0]]),
        (2.2, [[0.01, 0, 0], [0, 0.03, 0.04], [0, 0, 0]]),
    ):
        parts.p += torch.tensor(moves)
        watch.update(seconds)
    torch.testing.assert_close(watch.fastest(), torch.tensor([0.3, 0.5, 0.0]))
