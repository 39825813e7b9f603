"""Where pads touch a part in the closed hand: a bar with flat ends, 80 x 20 x 12 mm, across its width."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.core.grasp import PAD_REACH
from mskgrasp.parts import find_part
from mskgrasp.simulation.pad_contact import LEAST_LEVER, PAD_WIDTH, Held, moment_share, pad_contacts

BAR = find_part("parallel_key_b20x12x80")
HEIGHT = 0.0105
"""Of the TCP over the table: the pads' lower edges are 1 mm over it."""
UNDER_TOP = 0.012 - (HEIGHT - PAD_REACH)
"""Height of the bar's faces between the pads."""


def held_bar(along: float, angle: float = 0.0, slid: float = 0.0, swing: float = 0.0) -> Held:
    """The bar, grasped so far along it from its middle where it lay turned by minus ``angle``.

    The fingers have aligned it. In the hand it slid along the pads, and swung about them, by so much.
    """
    return Held(
        resting=0,
        grasp=np.array([along * np.cos(angle), along * np.sin(angle), HEIGHT, angle]),
        displacement=np.array([slid, 0.0, 0.0, angle]),
        swing=np.array([swing, 0.0]),
    )


def lever_of(width: float, height: float) -> float:
    """Mean distance of a rectangle's points from its middle."""
    share = (np.arange(1000) + 0.5) / 1000 - 0.5
    return float(np.hypot(width * share[:, None], height * share).mean())


def test_pads_in_the_middle_of_a_flat_face_touch_all_of_their_width():
    for contact in pad_contacts(BAR, held_bar(0.01)):
        assert contact.along == pytest.approx(0.0, abs=2e-4)
        assert contact.lever == pytest.approx(lever_of(PAD_WIDTH, UNDER_TOP), rel=0.03)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_at_an_end_only_what_the_pads_cover_counts(angle):
    """The bar ends 5 mm before the middle of the pads, which reach 8.75 mm to either side of it."""
    contacts = pad_contacts(BAR, held_bar(0.045, angle))
    assert len(contacts) == 2
    for contact in contacts:
        assert contact.along == pytest.approx(-(0.005 + PAD_WIDTH / 2) / 2, abs=3e-4)
        assert contact.lever == pytest.approx(lever_of(PAD_WIDTH / 2 - 0.005, UNDER_TOP), rel=0.08)


def test_the_bar_is_where_it_slid_to_in_the_hand():
    slid = held_bar(0.06, slid=0.015)  # as if it were grasped at 45 mm
    for contact, expected in zip(pad_contacts(BAR, slid), pad_contacts(BAR, held_bar(0.045)), strict=True):
        assert (contact.along, contact.lever) == pytest.approx((expected.along, expected.lever), abs=1e-4)


def test_a_bar_that_hangs_askew_touches_by_an_edge():
    """Turned about the pads' direction by 2 degrees, of 11 mm of its height the last 3 mm touch."""
    askew = pad_contacts(BAR, held_bar(0.01, swing=np.radians(2.0)))
    assert all(one.lever < 0.93 * lever_of(PAD_WIDTH, UNDER_TOP) for one in askew)
    assert all(one.lever == pytest.approx(PAD_WIDTH / 4, rel=0.1) for one in askew)


def test_a_part_that_is_not_between_the_pads_is_not_touched():
    assert pad_contacts(BAR, held_bar(0.06)) == []
    assert all(one.lever >= LEAST_LEVER for one in pad_contacts(BAR, held_bar(0.0486)))


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_weights_moment_is_a_share_of_what_even_pressure_holds(angle):
    """0.6 kg, 25 mm beside the pads: 0.147 N m; 2 x 12 N hold less over 5.5 mm, and carry 5.9 N besides."""
    heavy = dataclasses.replace(BAR, mass=0.6)
    carries = np.sqrt(1 - (0.6 * 9.81 / 24) ** 2)
    expected = 0.6 * 9.81 * 0.025 / (2 * 12 * lever_of(PAD_WIDTH, UNDER_TOP) * carries)
    assert expected > 1
    assert moment_share(heavy, held_bar(0.025, angle), 12.0) == pytest.approx(expected, rel=0.03)
    slid = held_bar(0.025, angle, slid=0.015)
    assert moment_share(heavy, slid, 12.0) == pytest.approx(0.4 * expected, rel=0.03)
    assert moment_share(dataclasses.replace(BAR, mass=2.5), held_bar(0.0), 12.0) == np.inf  # 24.5 N


def test_the_moment_is_about_where_the_pads_touch():
    """At the end of a bar they touch 1.9 mm nearer to its middle than they are, and on a smaller face."""
    arm, covered = 0.035 - (PAD_WIDTH / 2 - 0.005) / 2, PAD_WIDTH / 2 + 0.005
    light = dataclasses.replace(BAR, mass=0.01)
    expected = 0.01 * 9.81 * arm / (2 * 12 * lever_of(covered, UNDER_TOP))
    assert moment_share(light, held_bar(0.035), 12.0) == pytest.approx(expected, rel=0.04)
    assert moment_share(light, held_bar(0.06), 12.0) == np.inf
