"""Success and failure of attempts; batched, for numpy and torch alike."""

from __future__ import annotations

from dataclasses import dataclass

from array_api_compat import array_namespace

from mskgrasp.core.geometry import Array
from mskgrasp.core.grasp import EJECTED_DISTANCE, FAILURES, MIN_GAP, MIN_RISE

MAX_RELATIVE_SPEED = 0.05
"""A held part moves slower than this against the hand, m/s."""
MAX_PENETRATION = 1e-3
"""Deeper overlap of finger and part makes a label worthless, m."""
MIN_PAD_FORCE = 0.05
"""Least force of a contact, N."""
MAX_SPEED = 3.0
"""No grasp makes a part faster than this, m/s: a faster one was flung out of an overlap by the solver."""
MAX_DRIFT = 2e-4
"""A part that moves more than this on the table although nothing touches it is not at rest, m."""
MAX_TURN = 5e-3
"""The same for a turn, rad."""

CODE = {name: i for i, name in enumerate(FAILURES)}


@dataclass(frozen=True, kw_only=True)
class Observed:
    """Measurements of n attempts; every field has shape (n,).

    Attributes:
        settled: The part was at rest before anything touched it; if not, no other value means anything.
        collided: The descent met more force than the reflex allows.
        held_closed: Both pads touched the part, and there was a gap, when the fingers had closed.
        pads_touch: Both pads touch the part after the hold.
        gap: Distance of the pads after the hold, m.
        rise: Rise of the part, as a fraction of the lift.
        relative_speed: Speed of the part against the hand after the hold, m/s; NaN where nothing was lifted.
        penetration: Deepest overlap of finger and part seen, m; NaN where it is not known.
        wandered: Horizontal distance of the part from its resting place, m.
    """

    settled: Array
    collided: Array
    held_closed: Array
    pads_touch: Array
    gap: Array
    rise: Array
    relative_speed: Array
    penetration: Array
    wandered: Array


def judge(seen: Observed) -> tuple[Array, Array]:
    """Success and failure code of attempts.

    Returns:
        success: (n,) bool, S of the design: all conditions hold.
        failure: (n,) uint8, index into `mskgrasp.core.grasp.FAILURES`; the earliest reason wins.
    """
    holds = seen.pads_touch & (seen.gap > MIN_GAP) & (seen.rise >= MIN_RISE)
    overlap = seen.penetration > MAX_PENETRATION  # false where it is NaN: not known
    steady = (seen.relative_speed < MAX_RELATIVE_SPEED) & ~overlap
    success = seen.settled & ~seen.collided & seen.held_closed & holds & steady
    xp = array_namespace(seen.gap)
    # A part that still moves in the hand is slipping out of it.
    failure = xp.full_like(seen.gap, CODE["slipped"], dtype=xp.uint8)
    failure[~seen.held_closed] = CODE["missed"]
    failure[~holds & (seen.wandered > EJECTED_DISTANCE)] = CODE["ejected"]
    failure[seen.collided] = CODE["collided"]
    failure[~seen.settled] = CODE["unsettled"]
    failure[success] = CODE["none"]
    return success, failure
