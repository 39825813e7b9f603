"""Couplings and clamp collars: slots, jaws, grooves and bolts in place; one body each."""

import numpy as np
import pytest

from tests.parts.recipes.families.made_shapes import cylinder, extents, family, is_inside, made, radii


def turns_inside(solid, radius, z, step=2.0):
    """How often a circle enters the part."""
    angles = np.radians(np.arange(0, 360, step) + 0.3)
    inside = np.array([is_inside(solid, radius * np.cos(a), radius * np.sin(a), z) for a in angles])
    return int(np.count_nonzero(np.diff(np.append(inside, inside[:1]).astype(int)) == 1))


def test_a_sleeve_weighs_like_a_tube_less_four_screws():
    solid = made("sleeve_coupling_40x25x75")
    volume = cylinder(40, 75) - cylinder(25, 75) - 4 * cylinder(6, 7.5)
    assert solid.mesh.volume == pytest.approx(volume, rel=0.01)


def test_a_clamp_is_slotted_on_one_side_only():
    for name in ("clamp_coupling_60x35x84", "clamp_collar_72x50x22"):
        solid = made(name)
        outer = extents(solid)[1] / 2 - 2
        assert not is_inside(solid, outer, 0.5, 1.0) and is_inside(solid, -outer, 0.5, 1.0), name
        assert is_inside(solid, outer, 1.5, 1.0), name


def test_jaws_are_as_many_as_named_in_the_table():
    assert turns_inside(made("jaw_hub_60x24x90"), 24, 85) == 3
    assert turns_inside(made("jaw_hub_55x28x45"), 22, 40) == 2
    assert turns_inside(made("jaw_hub_55x28x45"), 22, 25) == 0  # a full ring


def test_a_spider_has_its_arms_and_bore():
    assert turns_inside(made("jaw_spider_57x18"), 24, 9) == 4
    assert turns_inside(made("jaw_spider_74x20"), 32, 10) == 6
    assert not is_inside(made("jaw_spider_74x20"), 0, 0, 10)


def test_the_grooves_of_an_oldham_disc_cross_at_right_angles():
    solid = made("oldham_disc_62x26")  # grooves 16 wide, 8.5 deep, 26 thick
    assert not is_inside(solid, 20, 0, 4) and is_inside(solid, 0, 20, 4)
    assert not is_inside(solid, 0, 20, 22) and is_inside(solid, 20, 0, 22)
    assert is_inside(solid, 20, 0, 13) and is_inside(solid, 0, 20, 13)


def test_bellows_have_as_many_folds_as_the_table_says():
    solid = made("bellows_coupling_55x92")  # hubs of 24, three folds of 6
    inside = np.array([is_inside(solid, 0, 24.5, z) for z in np.arange(1, 91, 0.5)])
    assert np.count_nonzero(np.diff(inside.astype(int)) == -1) == 4  # the lower hub and three folds


def test_both_halves_of_a_collar_hang_together_by_their_bolts_alone():
    solid = made("two_piece_collar_66x40x24")
    x = (33 + 20) / 2
    assert is_inside(solid, x, 0, 12) and is_inside(solid, -x, 0, 12)
    assert not is_inside(solid, x, 0, 3) and not is_inside(solid, -x, 0, 20)
    assert all(made(name).mesh.body_count == 1 for name in family("two_piece_collar")[:3])


def test_a_boss_stands_out_on_one_side():
    solid = made("boss_collar_62x46x30")
    points = np.asarray(solid.mesh.vertices)
    assert points[:, 0].max() == pytest.approx(31 + 22, abs=0.01)
    assert points[:, 0].min() == pytest.approx(-31, abs=0.01)


def test_every_coupling_with_a_bore_is_open():
    for kind in (
        "sleeve_coupling",
        "jaw_hub",
        "flange_coupling",
        "bellows_coupling",
        "beam_coupling",
        "hub_collar",
    ):
        for name in family(kind)[::3]:
            assert radii(made(name)).min() > 3.5, name
