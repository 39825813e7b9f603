"""Resting poses as the engine holds them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose, quat_conjugate, quat_multiply, twist_and_swing
from mskgrasp.core.settings import Physics
from mskgrasp.parts import find_part
from tasks.scene.standing import standing_poses
from tests.boxes import make_box


def test_a_block_stands_on_every_side_as_its_mesh_does(env, boxes):
    part = boxes["kilo"]
    found = standing_poses(part, Physics())
    assert found.toppled == 0
    assert found.probability == pytest.approx(part.resting_probability / part.resting_probability.sum())
    assert found.poses.position[:, 2] == pytest.approx(part.resting.position[:, 2], abs=2e-5)


def test_a_part_that_leans_in_the_engine_is_settled_first(env):
    """The hulls of this bolt touch the table elsewhere than its mesh: it leans by 1.7 degrees."""
    part = find_part("hex_bolt_m12x60")
    options = dict(parts=["hex_bolt_m12x60"], reconfigure=True)
    env.reset(seed=0, options=options)  # the engine's settings in force are those of the last scene made
    found = standing_poses(part, Physics())
    lean = twist_and_swing(quat_multiply(found.poses.quat_wxyz, quat_conjugate(part.resting.quat_wxyz)))[1]
    assert np.degrees(lean).max() == pytest.approx(1.66, abs=0.2)
    for seed in range(10):
        env.reset(seed=seed, options=options)
        options = {}
        before = env.part_pose()
        env.motion.step(200)
        after = env.part_pose()
        assert float((after.position - before.position).norm()) < 2e-5


def test_a_pose_that_topples_is_left_out(env, boxes, tmp_path):
    part = boxes["kilo"]
    # One more resting pose: the block on an edge.
    edge = np.array([np.cos(np.pi / 8), np.sin(np.pi / 8), 0, 0])
    resting = Pose(
        position=np.vstack([part.resting.position, [0, 0, 0.0175]]),
        quat_wxyz=np.vstack([part.resting.quat_wxyz, edge]),
    )
    share = np.append(part.resting_probability, part.resting_probability.sum())
    fallen = dataclasses.replace(part, resting=resting, resting_probability=share / share.sum())
    found = standing_poses(fallen, Physics())
    assert found.toppled == pytest.approx(0.5)
    assert len(found.probability) == len(part.resting_probability)
    alone = dataclasses.replace(
        part, resting=Pose.from_vector(resting.as_vector()[-1:]), resting_probability=np.ones(1)
    )
    with pytest.raises(BadPart, match="none of its 1 resting poses stands"):
        standing_poses(alone, Physics())


def test_the_same_part_settles_to_the_same_bits(env, boxes, tmp_path):
    again = make_box(tmp_path, "again", (0.04, 0.02, 0.03), 1.0)
    first, second = (standing_poses(part, Physics()) for part in (boxes["kilo"], again))
    assert np.array_equal(first.poses.as_vector(), second.poses.as_vector())
