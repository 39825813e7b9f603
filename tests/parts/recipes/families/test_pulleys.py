"""Pulleys, sprockets and rollers: grooves and teeth where belts and chains need them."""

import math

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made, radii


def entries(solid, radius, z, step=1.0):
    """How often a circle enters the part, and what share of it lies inside."""
    angles = np.radians(np.arange(0, 360, step) + 0.1)
    inside = np.array([is_inside(solid, radius * np.cos(a), radius * np.sin(a), z) for a in angles])
    return int(np.count_nonzero(np.diff(np.append(inside, inside[:1]).astype(int)) == 1)), inside.mean()


def test_timing_pulleys_have_their_teeth_between_flanges():
    solid = made("timing_pulley_p10_z16x40")
    tip = 16 * 10 / math.pi / 2 - 0.93
    assert entries(solid, tip - 0.5, 20)[0] == 16
    assert entries(solid, tip + 1, 1)[1] == 1  # the flange
    assert entries(solid, tip + 1, 20)[1] == 0


def test_fine_timing_pulleys_have_as_many_grooves():
    solid = made("fine_timing_pulley_p5p08_z24x12")
    tip = 24 * 5.08 / math.pi / 2 - 0.25
    count, share = entries(solid, tip - 0.4, 8)
    assert count == 24 and 0.4 < share < 0.7


@pytest.mark.parametrize(
    ("name", "datum", "width", "middle"),
    [("v_pulley_63x1x74", 63, 8.5, 8), ("v_pulley_56x1x66", 56, 5.3, 7)],
)
def test_a_v_groove_is_as_wide_as_the_belt_at_the_datum_diameter(name, datum, width, middle):
    solid = made(name)
    heights = np.arange(0.05, 2 * middle, 0.1)
    inside = np.array([is_inside(solid, datum / 2, 0, z) for z in heights])
    first = heights[: round(middle / 0.1) * 2][~inside[: round(middle / 0.1) * 2]]
    gap = first[np.abs(first - middle) < 5]
    assert np.ptp(gap) + 0.1 == pytest.approx(width, abs=0.15)
    assert gap.mean() == pytest.approx(middle, abs=0.1)


def test_sprockets_have_their_teeth_and_seats_for_the_rollers():
    for name, pitch, teeth, roller in (
        ("sprocket_p12p7_z16x28", 12.7, 16, 8.51),
        ("sprocket_p19p05_z9x70", 19.05, 9, 12.07),
    ):
        solid = made(name)
        circle = pitch / math.sin(math.pi / teeth) / 2
        assert entries(solid, circle, 3)[0] == teeth, name
        # A roller fits its seat: free up to its radius from the pitch circle inwards, steel beyond.
        assert not is_inside(solid, circle - roller / 2 + 0.1, 0, 3), name
        assert is_inside(solid, circle - roller / 2 - 0.1, 0, 3), name


def test_journals_carry_a_roller():
    solid = made("journal_roller_38x110")
    assert extents(solid) == pytest.approx([38, 38, 110 + 2 * 19], abs=0.05)
    assert solid.mesh.volume == pytest.approx(cylinder(38, 110) + 2 * cylinder(17, 19), rel=0.01)


def test_a_waisted_roller_is_thin_in_its_middle():
    solid = made("grooved_roller_58x80")
    assert is_inside(solid, 28, 0, 4) and not is_inside(solid, 19, 0, 40) and is_inside(solid, 17, 0, 40)


def test_every_wheel_is_bored_and_narrow_enough_for_the_gripper():
    kinds = ("timing_pulley", "fine_timing_pulley", "v_pulley", "flat_pulley", "sprocket", "guide_wheel")
    for kind in kinds:
        names = family(kind)
        assert len(names) >= 6
        for name in names[::5]:
            solid = made(name)
            assert radii(solid).min() > 3.5, name
            assert sorted(extents(solid))[1] <= 78.5, name
