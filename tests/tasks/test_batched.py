from __future__ import annotations

import pytest
import torch

from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.settings import Physics
from mskgrasp.simulation.shard import FIELDS, discard_reason
from tasks.scene.frames import BASE_IN_WORLD
from tests.tasks.toy_engine import ToyScene, toy_attempt

# Each row a sub-scene: the block, half the width that it stops the pads at, how it is carried, the force.
REASONS = ("none", "collided", "missed", "slipped", "none")
BLOCKS = torch.tensor(
    [[0.5, 0, 0.015], [0.5, 0.045, 0.015], [0.5, 0.15, 0.015], [0.45, 0.02, 0.015], [0.52, -0.01, 0.015]]
)
BETWEEN = torch.tensor([0.01, 0.01, 0.0, 0.01, 0.006])
CARRIED = torch.tensor([1.0, 1.0, 1.0, 0.2, 0.9])
STRUCK = torch.tensor([0.0, 80.0, 0.0, 0.0, 0.0])
GRASPS = torch.tensor(
    [
        [0.5, 0, 0.02, 0],
        [0.5, 0, 0.02, 0],
        [0.5, 0, 0.02, 0],
        [0.45, 0.02, 0.02, 0],
        [0.52, -0.012, 0.03, 0.1],
    ]
)
# Where hands end is no label: all of them lift where one does.
LABELS = ("success", "failure", "displacement", "tilt", "pose_base_obj", "pose_tcp_obj_before")


def outcomes(rows: list[int], physics: Physics) -> dict[str, torch.Tensor]:
    scene = ToyScene(BLOCKS[rows], BETWEEN[rows], CARRIED[rows], STRUCK[rows])
    return toy_attempt(scene, physics).run(GRASPS[rows])


@pytest.mark.slow
@pytest.mark.parametrize("skip_air", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_sub_scenes_do_not_depend_on_each_other(skip_air):
    physics = Physics(skip_air=skip_air)
    together = outcomes(list(range(len(REASONS))), physics)
    assert tuple(FAILURES[int(code)] for code in together["failure"]) == REASONS
    for row in range(len(REASONS)):
        alone = outcomes([row], physics)
        for name in LABELS:
            torch.testing.assert_close(
                together[name][row], alone[name][0], atol=2e-5, rtol=0, equal_nan=True, msg=f"{row} {name}"
            )


@pytest.mark.slow
def test_what_a_carried_block_did_is_told_for_its_own_sub_scene():
    found = outcomes(list(range(len(REASONS))), Physics())
    lift = Physics().lift_height
    succeeded = [reason == "none" for reason in REASONS]
    assert found["success"].tolist() == succeeded
    assert torch.isfinite(found["displacement"]).all(dim=-1).tolist() == succeeded
    assert found["displacement"][0].tolist() == pytest.approx([0, 0, 0, 0], abs=1e-4)
    # The last one is carried nine tenths of the way.
    assert found["displacement"][4, 2] == pytest.approx(-0.1 * lift, abs=1e-3)
    closed = [0, 3, 4]
    assert found["width_after"][closed].tolist() == pytest.approx((2 * BETWEEN[closed]).tolist(), abs=1e-4)
    assert torch.isnan(found["penetration"]).all()  # a GPU reports no contact points


@pytest.mark.parametrize(
    "low_or_far", [(0.5, 0.0, 0.005, 0.0), pytest.param((0.95, 0.0, 0.02, 0.0), marks=pytest.mark.slow)]
)
def test_a_grasp_that_cannot_be_executed_is_not_tried_and_leaves_the_others_alone(low_or_far):
    rows = list(range(len(REASONS)))
    alone = outcomes(rows, Physics())
    scene = ToyScene(*(torch.cat([of, of[:1]]) for of in (BLOCKS, BETWEEN, CARRIED, STRUCK)))
    found = toy_attempt(scene, Physics()).run(torch.cat([GRASPS, torch.tensor([low_or_far])]))
    assert found["executable"].tolist() == [True] * len(rows) + [False]
    assert FAILURES[int(found["failure"][-1])] == "unreachable"
    assert not found["success"][-1] and bool(torch.isnan(found["displacement"][-1]).all())
    torch.testing.assert_close(scene.part[-1], BLOCKS[0] + torch.tensor(BASE_IN_WORLD))
    for name in LABELS:
        torch.testing.assert_close(found[name][rows], alone[name], equal_nan=True, atol=0, rtol=0)


def test_an_attempt_whose_overlap_is_unknown_is_no_label():
    outcome = outcomes([0], Physics())
    row = {name: outcome[name][0].numpy() for name in FIELDS}
    assert outcome["success"][0] and discard_reason(outcome, row) == "overlap_unknown"
    known = dict(outcome, penetration=torch.zeros(1), fastest=torch.zeros(1))
    assert discard_reason(known, row) == ""


def test_frozen_arms_stay_where_they_are_and_the_others_arrive():
    scene = ToyScene(BLOCKS[:2], BETWEEN[:2], CARRIED[:2], STRUCK[:2])
    motion = toy_attempt(scene, Physics())._motion
    goal = torch.full((2, 7), 0.1, dtype=torch.float64) + scene.qpos[:, :7]
    motion.set_arm(goal, torch.zeros(2, 7))
    motion.step()
    before = scene.qpos.clone()
    assert not torch.allclose(before[1, :7], goal[1].float())
    motion.arrive(torch.tensor([True, False]))
    assert torch.equal(scene.qpos[0], before[0])
    torch.testing.assert_close(scene.qpos[1, :7], goal[1].float(), atol=1e-6, rtol=0)
    assert torch.equal(scene.qpos[:, 7:], before[:, 7:])
