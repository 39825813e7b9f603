"""Where pads touch a part in the closed hand: a bar with flat ends, 80 x 20 x 12 mm, across its width."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.parts import find_part
from mskgrasp.simulation.pad_contact import LEAST_LEVER, PAD_WIDTH, pad_contacts
from tests.planning.test_certified import certified_grasp

BAR = find_part("parallel_key_b20x12x80")
HEIGHT = 0.0105
"""Of the TCP over the table: the pads' lower edges are 1 mm over it."""


def bar_grasp(along: float, angle: float = 0.0, **changes):
    """A grasp so far along the bar from its middle, the bar turned by minus ``angle`` in the grasp frame."""
    grasp = np.array([along * np.cos(angle), along * np.sin(angle), HEIGHT, angle])
    still = dict(mean=np.array([0.0, 0.0, 0.0, angle]), swing=np.zeros(2))
    return certified_grasp(**(dict(grasp=grasp) | still | changes))


def lever_of(width: float, height: float) -> float:
    """Mean distance of a rectangle's points from its middle."""
    share = (np.arange(1000) + 0.5) / 1000 - 0.5
    return float(np.hypot(width * share[:, None], height * share).mean())


UNDER_TOP = 0.012 - (HEIGHT - PAD_REACH)
"""Height of the bar's faces between the pads."""


def test_pads_in_the_middle_of_a_flat_face_touch_all_of_their_width():
    for contact in pad_contacts(BAR, bar_grasp(0.01)):
        assert contact.along == pytest.approx(0.0, abs=2e-4)
        assert contact.lever == pytest.approx(lever_of(PAD_WIDTH, UNDER_TOP), rel=0.03)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_at_an_end_only_what_the_pads_cover_counts(angle):
    """The bar ends 5 mm before the middle of the pads, which reach 8.75 mm to either side of it."""
    contacts = pad_contacts(BAR, bar_grasp(0.045, angle))
    assert len(contacts) == 2
    for contact in contacts:
        assert contact.along == pytest.approx(-(0.005 + PAD_WIDTH / 2) / 2, abs=3e-4)
        assert contact.lever == pytest.approx(lever_of(PAD_WIDTH / 2 - 0.005, UNDER_TOP), rel=0.08)


def test_the_bar_is_where_it_slid_to_in_the_hand():
    slid = bar_grasp(0.06, mean=np.array([0.015, 0.002, 0.0, 0.0]))  # as if it were grasped at 45 mm
    for contact, expected in zip(pad_contacts(BAR, slid), pad_contacts(BAR, bar_grasp(0.045)), strict=True):
        assert (contact.along, contact.lever) == pytest.approx((expected.along, expected.lever), abs=1e-4)


def test_a_bar_that_hangs_askew_touches_by_an_edge():
    """Turned about the pads' direction by 2 degrees, of 11 mm of its height the last 3 mm touch."""
    askew = pad_contacts(BAR, bar_grasp(0.01, swing=np.array([np.radians(2.0), 0.0])))
    assert all(one.lever < 0.93 * lever_of(PAD_WIDTH, UNDER_TOP) for one in askew)
    assert all(one.lever == pytest.approx(PAD_WIDTH / 4, rel=0.1) for one in askew)


def test_a_part_that_is_not_between_the_pads_is_not_touched():
    assert pad_contacts(BAR, bar_grasp(0.06)) == []
    assert all(one.lever >= LEAST_LEVER for one in pad_contacts(BAR, bar_grasp(0.0486)))
