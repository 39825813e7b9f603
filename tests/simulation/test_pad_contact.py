"""Where pads touch a part in the closed hand: a bar with flat ends, 80 x 20 x 12 mm, across its width."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.geometry import Pose, quat_about_z, quat_rotate, swing_vector, twist_and_swing
from mskgrasp.core.grasp import PAD_HEIGHT, PAD_REACH, PAD_WIDTH
from mskgrasp.parts import Part, find_part
from mskgrasp.simulation.pad_contact import LEAST_LEVER, HeldPart, PadContact, moment_share, pad_contact
from tests.boxes import make_box, make_u

BAR = find_part("parallel_key_b20x12x80")
HEIGHT = 0.0105
"""Of the TCP over the table: the pads' lower edges are 1 mm over it."""
UNDER_TOP = 0.012 - (HEIGHT - PAD_REACH)
"""Height of the bar's faces between the pads."""


def held(
    along: float, angle: float = 0.0, slid: float = 0.0, swing: float = 0.0, *, part: Part = BAR, aligned=True
) -> HeldPart:
    """The bar, grasped so far along it from its middle where it lay turned by minus ``angle``.

    Unless stated, the fingers have aligned it. In the hand it slid along the pads, and swung about them.
    """
    return HeldPart(
        part=part,
        resting=0,
        grasp=np.array([along * np.cos(angle), along * np.sin(angle), HEIGHT, angle]),
        displacement=np.array([slid, 0.0, 0.0, angle if aligned else 0.0]),
        swing=np.array([swing, 0.0]),
    )


def touched(one: HeldPart) -> PadContact:
    contact = pad_contact(one)
    assert contact is not None
    return contact


def lever_of(width: float, height: float) -> float:
    """Mean distance of a rectangle's points from its middle."""
    share = (np.arange(1000) + 0.5) / 1000 - 0.5
    return float(np.hypot(width * share[:, None], height * share).mean())


def test_pads_in_the_middle_of_a_flat_face_touch_all_of_their_width():
    contact = touched(held(0.01))
    assert contact.along == pytest.approx(0.0, abs=3e-4)
    assert contact.lever == pytest.approx(lever_of(PAD_WIDTH, UNDER_TOP), rel=0.04)


def test_a_face_higher_than_the_pads_is_touched_as_high_as_they_are(tmp_path):
    box = make_box(tmp_path, "box", (0.08, 0.02, 0.05), 0.1)
    lying = next(
        row for row in range(len(box.resting_probability)) if abs(box.resting.position[row, 2] - 0.025) < 1e-3
    )
    high = dataclasses.replace(held(0.0, part=box), resting=lying, grasp=np.array([0, 0, 0.025, 0.0]))
    assert touched(high).lever == pytest.approx(lever_of(PAD_WIDTH, PAD_HEIGHT), rel=0.04)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_at_an_end_only_what_the_pads_cover_counts(angle):
    """The bar ends 5 mm before the middle of the pads, which reach 8.75 mm to either side of it."""
    contact = touched(held(0.045, angle))
    assert contact.along == pytest.approx(-(0.005 + PAD_WIDTH / 2) / 2, abs=3e-4)
    assert contact.lever == pytest.approx(lever_of(PAD_WIDTH / 2 - 0.005, UNDER_TOP), rel=0.08)


def test_the_bar_is_where_it_slid_to_in_the_hand():
    slid, expected = touched(held(0.06, slid=0.015)), touched(held(0.045))
    assert (slid.along, slid.lever) == pytest.approx((expected.along, expected.lever), abs=2e-4)


def test_a_bar_that_stays_turned_is_touched_at_an_edge_by_each_pad():
    """Turned by 0.1 rad one pad meets it at its right edge, the other at its left one."""
    contact = touched(held(0.0, 0.1, aligned=False))
    assert contact.along == pytest.approx(0.0, abs=3e-4)
    strip = 1e-4 / np.tan(0.1)
    # Friction at opposite edges has no moment about the line from one to the other.
    assert contact.lever == pytest.approx(lever_of(strip, UNDER_TOP), rel=0.06)


def test_a_bar_that_hangs_askew_is_touched_by_an_edge_of_each_pad():
    """Turned about the pads' direction by 2 degrees, of 11 mm of its height the last 3 mm touch."""
    contact = touched(held(0.01, swing=np.radians(2.0)))
    strip = 1e-4 / np.tan(np.radians(2.0))
    assert contact.lever == pytest.approx(lever_of(PAD_WIDTH, strip), rel=0.06)


def held_by_a_leg(cache: Path, turn: float = 0.0) -> HeldPart:
    """A U, grasped at the middle of its near leg, across it or turned from that."""
    part, leg = make_u(cache, "u")
    up = quat_rotate(part.resting.quat_wxyz, np.array([0.0, 0.0, 1.0]))
    row = int(np.argmax(up[:, 2]))  # as it was drawn
    x, y, z = quat_rotate(part.resting.quat_wxyz[row], leg) + part.resting.position[row]
    along = quat_rotate(part.resting.quat_wxyz[row], np.array([1.0, 0.0, 0.0]))
    grasp = np.array([x, y, z, np.arctan2(along[1], along[0]) + turn])
    return HeldPart(part=part, resting=row, grasp=grasp, displacement=np.zeros(4), swing=np.zeros(2))


def test_the_other_leg_of_a_part_outside_the_open_fingers_is_not_touched(tmp_path):
    contact = touched(held_by_a_leg(tmp_path))
    assert contact.lever == pytest.approx(lever_of(PAD_WIDTH, PAD_HEIGHT), rel=0.04)
    assert contact.along == pytest.approx(0.0, abs=4e-4)  # 2 mm beside it if the far leg counted


def test_the_axis_of_a_leg_jammed_between_corners_is_at_an_angle(tmp_path):
    """Turned by 0.1 rad, the leg, 10 mm thick, is touched at opposite corners of the pads."""
    one = held_by_a_leg(tmp_path, 0.1)
    apart = PAD_WIDTH - 1e-4 / np.tan(0.1)
    thickness = 0.01 * np.cos(0.1) + PAD_WIDTH * np.sin(0.1)
    beside = -one.T_grasp_obj.position[1]
    assert 0.03 < beside < 0.06  # the part's centre of mass is on the other side of the corner
    assert touched(one).along == pytest.approx(beside / thickness * apart, rel=0.05)


def test_a_part_that_is_not_between_the_pads_is_not_touched():
    assert pad_contact(held(0.06)) is None
    assert touched(held(0.0486)).lever >= LEAST_LEVER


def test_the_pose_in_the_hand_is_that_of_displacement_and_swing():
    rng = np.random.default_rng(0)
    for theta, dtheta in ((0.4, 0.0), (-1.2, 0.3)):
        one = dataclasses.replace(
            held(0.02),
            grasp=np.array([0.01, -0.02, HEIGHT, theta]),
            displacement=np.append(1e-3 * rng.normal(size=3), dtheta),
            swing=np.array([0.02, -0.03]),
        )
        before, after = one.T_grasp_obj_before, one.T_grasp_obj
        T_base_grasp = Pose(position=one.grasp[:3], quat_wxyz=quat_about_z(np.asarray(theta)))
        in_rest = (T_base_grasp @ before).position  # over the origin of the rest frame
        assert in_rest == pytest.approx([0.0, 0.0, BAR.resting.position[0, 2]], abs=1e-12)
        moved = (
            Pose(position=np.zeros(3), quat_wxyz=after.quat_wxyz)
            @ Pose(position=np.zeros(3), quat_wxyz=before.quat_wxyz).inverse()
        )
        assert float(twist_and_swing(moved.quat_wxyz)[0]) == pytest.approx(dtheta, abs=1e-9)
        assert swing_vector(moved.quat_wxyz) == pytest.approx(one.swing, abs=1e-9)
        assert after.position - before.position == pytest.approx(one.displacement[:3])


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_weights_moment_is_a_share_of_what_even_pressure_holds(angle):
    """0.6 kg, 25 mm beside the pads: 0.147 N m; 2 x 12 N hold less over 5.5 mm, and carry 5.9 N besides."""
    heavy = dataclasses.replace(BAR, mass=0.6)
    carries = np.sqrt(1 - (0.6 * 9.81 / 24) ** 2)
    expected = 0.6 * 9.81 * 0.025 / (2 * 12 * lever_of(PAD_WIDTH, UNDER_TOP) * carries)
    assert expected > 1
    assert moment_share(held(0.025, angle, part=heavy), 12.0) == pytest.approx(expected, rel=0.04)
    slid = held(0.025, angle, slid=0.015, part=heavy)
    assert moment_share(slid, 12.0) == pytest.approx(0.4 * expected, rel=0.05)
    across = dataclasses.replace(held(0.0, part=heavy), grasp=np.array([0.0, 0.008, HEIGHT, 0.0]))
    assert moment_share(across, 12.0) < 0.03 * expected  # across the pads its centre may lie where it will
    for friction in (2.9, 0.0):  # not even the weight
        assert moment_share(held(0.0, part=heavy), friction) == np.inf


def test_the_moment_is_about_where_the_pads_touch():
    """At the end of a bar they touch 1.9 mm nearer to its middle than they are, and on a smaller face."""
    arm, covered = 0.035 - (PAD_WIDTH / 2 - 0.005) / 2, PAD_WIDTH / 2 + 0.005
    light = dataclasses.replace(BAR, mass=0.01)
    expected = 0.01 * 9.81 * arm / (2 * 12 * lever_of(covered, UNDER_TOP))
    assert moment_share(held(0.035, part=light), 12.0) == pytest.approx(expected, rel=0.05)
    assert moment_share(held(0.06, part=light), 12.0) == np.inf
