"""The reflex: a mean force that depends neither on the simulation's rate nor on when a contact begins."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from tasks.robot.reflex import Reflex

TOP = 0.03 + 0.0095
"""A hand at this height touches the block of 3 cm with the tips of its pads, m."""


@pytest.fixture(scope="module", params=[500, 1000, 2000])
def at_rate(request, boxes):
    """The task at a rate, with a block of 1 kg under a finger."""
    folder = str(boxes["kilo"].folder)
    made = gymnasium.make(
        "GraspDisplacement-v1", parts=[folder], obs_mode="none", render_backend="none",
        physics=dict(rate_hz=request.param),
    )  # fmt: skip
    yield made.unwrapped
    made.close()


def descend(env, monkeypatch, depth: float, height: float) -> tuple[bool, float]:
    """Whether a descent from ``height`` over the block to ``depth`` in it collided, and its peak force."""
    peak = [0.0]
    force = Reflex.force

    def noted(self):
        found = force(self)
        peak[0] = max(peak[0], float(found[0]))
        return found

    monkeypatch.setattr(Reflex, "force", noted)
    pose = np.array([[0.5, 0.045, 0.015, 1, 0, 0, 0]])
    env.reset(seed=0, options=dict(parts=[str(env.parts[0].folder)], reconfigure=True, pose_base_obj=pose))
    lower = env.physics.model_copy(update={"approach_clearance": height})
    monkeypatch.setattr(env.attempt, "_physics", lower)
    info = env.step(np.array([[0.5, 0.0, TOP - depth, 0.0]], dtype=np.float32))[-1]
    return int(info["failure"][0]) == 4, peak[0]


@pytest.mark.parametrize(
    "height", [0.01, *(pytest.param(height, marks=pytest.mark.slow) for height in (0.0103, 0.0107, 0.0111))]
)
def test_the_reflex_depends_neither_on_the_rate_nor_on_the_phase_of_a_step(at_rate, monkeypatch, height):
    """A finger that stops 0.6 mm over the block, grazes it, is sent 0.4 mm into it, or 2 mm."""
    clear, graze, light, deep = (
        descend(at_rate, monkeypatch, depth, height) for depth in (-6e-4, -1e-4, 4e-4, 2e-3)
    )
    assert clear == (False, 0.0)
    # At all rates and phases, where the forces of single steps range from 0 to 300 N.
    assert not graze[0] and 10 < graze[1] < 14.5
    assert light[0] and deep[0]


def test_a_part_in_the_hand_loads_the_arm_only_where_it_meets_something_else(env, attempt):
    """Aloft its grip and weight are no contact; on the table, pressed down by some newtons, it is one."""
    assert attempt((0.5, 0.0, 0.02, 0.0), part="kilo")["success"]
    alone, together = Reflex(env.contacts, env.motion), Reflex(env.contacts, env.motion, holding=True)
    for _ in range(50):
        env.motion.step()
        held, carried = float(alone.force()[0]), float(together.force()[0])
    # The hand alone feels what its pads press on the part, unequal by what the arm's sway takes.
    assert carried == 0 and held < 2
