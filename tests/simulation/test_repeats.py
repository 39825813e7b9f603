"""Repeated simulations of a grasp: seeded, and measured from the pose in which the part is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from mskgrasp.core.settings import ExecutionNoise, Overhead, Physics
from mskgrasp.parts import Part
from mskgrasp.simulation.repeats import PoseErrors, repeat_grasp
from mskgrasp.simulation.shard import Simulator
from tasks import GraspDisplacementEnv
from tests.boxes import make_box

SIZE = (0.06, 0.03, 0.02)
LONG_SIDE = np.array([0.0, 0.0, 0.0105, 0.0])
"""Pads on the long sides of the box, through its middle: they close along its y."""
NONE = PoseErrors(position=0.0, height=0.0, turn=0.0)


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Part:
    return make_box(tmp_path_factory.mktemp("box"), "box", SIZE, 0.1)


@pytest.fixture(scope="module")
def env(box: Part) -> Iterator[GraspDisplacementEnv]:
    simulator = Simulator(Physics(), Overhead(), ExecutionNoise())
    yield simulator.load(str(box.folder))
    simulator.close()


def lying(env: GraspDisplacementEnv) -> int:
    """The resting pose on the largest side, in which obj has the axes of the mesh but for half turns."""
    return int(np.argmin(env.standing[0].poses.position[:, 2]))


def along_y(env: GraspDisplacementEnv, which: int) -> np.ndarray:
    """`LONG_SIDE` in the rest frame, whose x need not be the box's long edge."""
    rotation = env.parts[0].resting.as_matrix()[env.standing[0].numbers[which]]
    theta = np.arctan2(rotation[1, 0], rotation[0, 0])
    return LONG_SIDE + [0.0, 0.0, 0.0, theta]


def test_the_same_seed_gives_the_same_outcome(env):
    which = lying(env)
    first, other, again = (
        repeat_grasp(env, which, along_y(env, which), PoseErrors(), seed) for seed in ((1, 2), (1, 3), (1, 2))
    )
    assert np.array_equal(first.displacement, again.displacement)
    assert np.array_equal(first.error, again.error)
    assert not np.array_equal(first.error, other.error)


def test_a_box_held_in_its_middle_does_not_move(env):
    which = lying(env)
    for seed in range(3):
        found = repeat_grasp(env, which, along_y(env, which), NONE, (seed,))
        assert found.reason == ""
        assert np.abs(found.displacement[:3]).max() < 1e-4 and abs(found.displacement[3]) < 1e-3
        assert np.linalg.norm(found.swing) < 2e-3


def test_across_the_pads_the_fingers_undo_the_error_of_the_seen_pose_and_along_them_they_do_not(env):
    which = lying(env)
    errors = PoseErrors(position=1e-3, height=0.0, turn=0.0)
    found = [repeat_grasp(env, which, along_y(env, which), errors, (7, seed)) for seed in range(6)]
    error, moved = (np.stack([getattr(one, name) for one in found]) for name in ("error", "displacement"))
    assert np.abs(error[:, :2]).max() > 5e-4
    assert moved[:, 0] == pytest.approx(error[:, 0], abs=1e-4)  # along the pads: where it truly lay
    assert moved[:, 1] == pytest.approx(0.0, abs=1e-4)  # across: in the middle of the hand


def test_a_turn_of_the_box_is_undone_by_the_pads(env):
    which = lying(env)
    errors = PoseErrors(position=0.0, height=0.0, turn=0.02)
    found = [repeat_grasp(env, which, along_y(env, which), errors, (8, seed)) for seed in range(4)]
    assert max(abs(one.error[3]) for one in found) > 0.01
    assert [one.displacement[3] for one in found] == pytest.approx([0.0] * 4, abs=2e-3)


def test_hands_that_close_on_nothing_miss(env):
    which = lying(env)
    found = repeat_grasp(env, which, np.array([0.1, 0.0, 0.0105, 0.0]), NONE, (1,))
    assert found.reason == "missed" and np.isnan(found.displacement).all()
