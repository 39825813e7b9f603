"""Detector of parts at rest on the table, from their motion between samples 20 ms apart."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import sapien
from mani_skill.utils.structs.actor import Actor
from sapien.physx import PhysxRigidDynamicComponent

STILL_SPEED, STILL_TURN = 0.002, 0.05
"""Mean speeds of a quiet part between two samples, m/s and rad/s."""
QUIET_S = 0.08
"""Time for which a part that has moved, or leaned on the hand, must be quiet to be at rest, s: one that
begins to topple, or turns back as it rocks, is not for so long."""
JITTER_SPEED, JITTER_TURN = 0.01, 0.5
"""Greatest speeds of a part at rest within a step, m/s and rad/s: one that stands on many points may tremble,
a heat sink on its pins by 4 mm/s and 0.2 rad/s, by which it creeps by up to 1 mm/s."""


class RestWatch:
    """Bodies that were placed at rest, and whether they have been at rest since, or are again."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[float, sapien.Pose]] = {}
        self._quiet: dict[str, float] = {}

    def look(self, seconds: float, bodies: Iterable[Actor], *, touched: bool) -> None:
        """Compare the poses of bodies with those at the last look.

        Args:
            seconds: Simulated time.
            bodies: Each of one sub-scene, with a name of its own.
            touched: Something touches the hand, perhaps one of them.
        """
        for body in bodies:
            now = body._objs[0].pose
            before, last = self._last.get(body.name, (seconds, now))
            self._last[body.name] = seconds, now
            passed = max(seconds - before, 1e-9)
            speed = math.dist(now.p, last.p) / passed
            turn = 2 * math.hypot(*(last.inv() * now).q[1:]) / passed
            if touched or speed > STILL_SPEED or turn > STILL_TURN:
                self._quiet[body.name] = 0.0
            else:
                self._quiet[body.name] = self._quiet.get(body.name, math.inf) + seconds - before

    def at_rest(self, body: Actor) -> bool:
        """Whether a body has been quiet long enough, and hardly moves now."""
        rigid = rigid_component(body)
        speed, turn = (float(np.linalg.norm(v)) for v in (rigid.linear_velocity, rigid.angular_velocity))
        quiet = self._quiet.get(body.name, 0.0) >= QUIET_S
        return quiet and speed < JITTER_SPEED and turn < JITTER_TURN


def rigid_component(body: Actor) -> PhysxRigidDynamicComponent:
    """The dynamic component of a body of one sub-scene."""
    found = body._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    assert isinstance(found, PhysxRigidDynamicComponent)
    return found
