"""The reflex that stops a hand: the mean contact force on it over a fixed time."""

from __future__ import annotations

from collections import deque

from mskgrasp.core.geometry import Array
from tasks.robot.contacts import HandContacts
from tasks.robot.motion import PandaMotion

WINDOW_S = 0.024
"""Time over which the force is averaged, s. A robot's estimate of the external force is filtered, too; and
the force of an impact within one step would depend on the length of the step."""
NEAR_S = 0.004
"""Time between two checks of what is near the hand, s: it moves at most 1.6 mm, pairs are listed within 2 mm
(twice the contact offset)."""


class Reflex:
    """Mean contact force on the hand over the last ``WINDOW_S``, sampled at every step of a motion.

    It does not depend on the rate of the simulation, nor on when a contact begins. Steps are not sampled
    while nothing is near the hand.

    Args:
        contacts: Contacts of the hand.
        motion: Gives the rate, which must not change.
        holding: Whether a part in the hand counts as one with it.
    """

    def __init__(self, contacts: HandContacts, motion: PandaMotion, *, holding: bool = False):
        self._contacts = contacts
        self._holding = holding
        self._n = motion.n_steps(WINDOW_S)
        self._check_every = motion.n_steps(NEAR_S)
        self._none = motion.arrays.full(motion.n, 0.0)
        self._loads: deque[Array] = deque(maxlen=self._n)
        self._steps = 0
        self._near = False

    @property
    def near(self) -> bool:
        """Whether anything was near the hand when `force` looked last; without, the force is zero."""
        return self._near

    @property
    def full(self) -> bool:
        """Whether the window is full of samples; the mean takes missing ones as zero."""
        return len(self._loads) == self._n or not self._near

    def force(self) -> Array:
        """(n,) the mean force, N; to be called after every step."""
        if self._steps % self._check_every == 0:
            self._near = self._contacts.near(holding=self._holding)
        self._steps += 1
        if not self._near:
            self._loads.clear()
            return self._none
        self._loads.append(self._contacts.load(holding=self._holding))
        total = sum(self._loads) / self._n
        return (total * total).sum(-1) ** 0.5
