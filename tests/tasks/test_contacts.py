"""Contacts of the hand."""

from __future__ import annotations

import numpy as np
import pytest

Z = 0.02


def test_the_grip_is_no_force_on_hand_and_part_together(attempt, env):
    """Each pad feels 30 N; nothing but the hand touches a part that is held aloft."""
    assert attempt((0.5, 0.0, Z, 0.0), part="kilo")["success"]
    assert np.asarray(env.contacts.pads_on_part()[0]) == pytest.approx(30, rel=0.05)
    assert not np.asarray(env.contacts.load(holding=True)).any()
