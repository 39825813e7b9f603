import numpy as np
import pytest
import trimesh

from mskgrasp.parts import find_part
from mskgrasp.parts.load import load_part
from mskgrasp.perception.part_pose import KnownPart
from tests.perception.part_pose.cells import known, resting_at


def orders(name: str) -> dict[int, int]:
    return {one.resting: one.order for look in known(name).looks for one in look.poses}


def test_a_nut_has_six_turns_flat_and_two_on_a_side():
    found = orders("hex_nut_m30")
    heights = find_part("hex_nut_m30").resting.position[:, 2]
    flat = set(np.flatnonzero(np.isclose(heights, heights.min(), atol=1e-4)).tolist())
    assert flat and {found[i] for i in flat} == {6}
    assert {found[i] for i in set(found) - flat} == {2}


def test_a_washer_has_any_turn_and_a_bracket_one():
    assert orders("washer_m36")[0] == 0
    assert orders("l_bracket_60x40")[0] == 1


@pytest.mark.parametrize("name", ["hex_nut_m30", "washer_m36"])
def test_a_nut_and_a_washer_are_the_same_after_every_turn_at_which_they_look_the_same(name):
    assert all(one.symmetric for look in known(name).looks for one in look.poses)


def test_a_plate_keyed_by_a_small_hole_or_on_its_underside_only_looks_the_same(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    plate = trimesh.creation.box([0.1, 0.06, 0.008])
    # Holes: a through one of 3 mm, too small to be seen, and a blind one of 10 mm.
    for name, radius, height in (("hole", 0.0015, 0.02), ("blind", 0.005, 0.004)):
        drill = trimesh.creation.cylinder(radius=radius, height=height)
        drill.apply_translation([0.04, 0.02, 0.004])
        path = tmp_path / f"{name}.stl"
        trimesh.boolean.difference([plate, drill]).apply_scale(1e3).export(path)
        part = load_part(path)
        up = part.resting.as_matrix()[:, 2, 2]  # of the drilled side
        lying = {one.resting: one for look in KnownPart.of(part).looks for one in look.poses}
        for side in (1, -1):
            one = lying[int(np.argmax(side * up))]
            sees = name == "blind" and side == 1
            assert (one.order, one.symmetric) == ((1, True) if sees else (2, False))


def test_a_block_with_ports_nearly_looks_the_same_after_half_a_turn_and_a_bracket_at_no_other_turn():
    block = {look.poses[0].resting: look.rivals for look in known("port_block_55x35").looks}
    assert np.degrees(block[6]) == pytest.approx([180], abs=1)
    assert all(look.rivals == () for look in known("l_bracket_60x40").looks)
    assert all(look.rivals == () for look in known("washer_m36").looks if look.poses[0].order == 0)


def test_both_sides_of_a_nut_look_alike():
    looks = known("hex_nut_m30").looks
    assert {one.resting for one in looks[0].poses} == {0, 1}


@pytest.mark.slow
def test_every_resting_pose_is_looked_for_once():
    for name in ("hex_nut_m30", "l_bracket_60x40", "spur_gear_m3_z17"):
        found = [one.resting for look in known(name).looks for one in look.poses]
        assert sorted(found) == list(range(len(find_part(name).resting_probability)))


def test_resting_poses_that_do_not_stand_are_left_out():
    part = find_part("l_bracket_60x40")
    stands = [i == 1 for i in range(len(part.resting_probability))]
    found = KnownPart.of(part, stands)
    assert [one.resting for look in found.looks for one in look.poses] == [1]


def test_a_part_without_a_resting_pose_is_refused():
    part = find_part("washer_m36")
    with pytest.raises(ValueError, match="no resting pose of"):
        KnownPart.of(part, [False] * len(part.resting_probability))


@pytest.mark.parametrize("turn", [0.0, 2.5])
def test_the_pose_at_a_place_and_turn_is_the_resting_pose_moved_there(turn):
    part = known("l_bracket_60x40")
    for look in part.looks:
        for one in look.poses:
            found = part.pose(one, 0.5, -0.1, turn, table_z=0.0)
            true = resting_at("l_bracket_60x40", one.resting, 0.5, -0.1, turn)
            assert np.allclose(found.as_matrix(), true.as_matrix(), atol=1e-9)


def test_the_outline_reaches_as_far_as_the_surface_at_any_turn():
    for look in known("spur_gear_m3_z17").looks:
        surface = look.poses[0].surface
        assert surface is not None
        for turn in np.linspace(0, 2 * np.pi, 12):
            across = np.array([np.cos(turn), np.sin(turn)])
            reach = (surface.vertices[:, :2] @ across).max()
            assert (look.outline @ across).max() == pytest.approx(reach, abs=1e-7)


def test_surfaces_are_on_and_above_the_table():
    for name in ("spur_gear_m3_z17", "l_bracket_60x40"):
        for look in known(name).looks:
            for surface in (one.surface for one in look.poses if one.surface is not None):
                assert surface.vertices[:, 2].min() > -1e-4  # hulls lie on the table, not the mesh
                assert surface.vertices[:, 2].max() == pytest.approx(look.top, abs=0.5e-3)


def test_facets_of_a_body_of_revolution_are_not_distinguished():
    looks = known("shaft_collar_25").looks
    assert any(len(look.poses) > 12 for look in looks)
    for look in looks:
        assert look.poses[0].surface is not None
        assert all((one.surface is not None) == (len(look.poses) <= 12) for one in look.poses[1:])
