from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import sapien

from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.rest import JITTER_SPEED, QUIET_S, STILL_SPEED, STILL_TURN, RestWatch, rigid_component
from hal.sim.world import SapienWorld

EVERY = 0.02


@pytest.fixture(scope="module")
def hook() -> Iterator[SapienWorld]:
    """A hook lies on three points, and trembles there."""
    world = sapien_cell(SapienCellConfig(type="sapien", part="s_hook_8x26", seed=3)).feeder
    assert isinstance(world, SapienWorld)
    world.open()
    yield world
    world.close()


def test_a_part_that_trembles_where_it_lies_is_at_rest(hook: SapienWorld):
    rigid = rigid_component(hook.env.part)
    quick, resting = [], []
    for _ in range(60):
        hook.env.motion.step()
        turn = np.linalg.norm(rigid.angular_velocity)
        quick.append(np.linalg.norm(rigid.linear_velocity) > STILL_SPEED or turn > STILL_TURN)
        resting.append(hook.at_rest())
    assert any(quick) and all(resting)


def turned_by(angle: float) -> sapien.Pose:
    return sapien.Pose(q=[np.cos(angle / 2), 0, 0, np.sin(angle / 2)])


@pytest.mark.parametrize(
    ("motion", "touched", "quiet"),
    [
        (sapien.Pose(), False, True),
        (sapien.Pose(), True, False),  # it may lean on the hand
        (sapien.Pose([0.8 * STILL_SPEED * EVERY, 0, 0]), False, True),
        (sapien.Pose([1.2 * STILL_SPEED * EVERY, 0, 0]), False, False),
        (turned_by(0.8 * STILL_TURN * EVERY), False, True),
        (turned_by(1.2 * STILL_TURN * EVERY), False, False),
    ],
)
def test_a_part_that_moved_or_was_touched_is_at_rest_when_it_has_been_quiet_for_long(
    hook: SapienWorld, motion: sapien.Pose, touched: bool, quiet: bool
):
    body, watch, seconds = hook.env.part, RestWatch(), 1.0
    rigid_component(body).set_linear_velocity([0.0, 0.0, 0.0])
    rigid_component(body).set_angular_velocity([0.0, 0.0, 0.0])
    assert not watch.at_rest(body)
    watch.look(seconds, [body], touched=False)
    assert watch.at_rest(body)  # it was placed at rest
    body.set_pose(body.pose.sp * motion)
    watch.look(seconds := seconds + EVERY, [body], touched=touched)
    assert watch.at_rest(body) == quiet
    for _ in range(round(QUIET_S / EVERY)):
        assert watch.at_rest(body) == quiet
        watch.look(seconds := seconds + EVERY, [body], touched=False)
    assert watch.at_rest(body)
    rigid_component(body).set_linear_velocity([1.1 * JITTER_SPEED, 0.0, 0.0])
    assert not watch.at_rest(body)
