"""Slots: what may stand in their file, what fits into them, and what lies how."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hal import cell_from_yaml
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.palletize.pallet_slots import Slot, check_reach, check_room, parse_target, read_slots
from mskgrasp.parts import find_part
from mskgrasp.perception.footprint import Footprint, footprint_of, seen_footprint, usual_footprint
from tests.synthetic import REGION, TABLE_Z, Box, frame

REPOSITORY = Path(__file__).parents[2]
GRID = REPOSITORY / "configs" / "palletize" / "grid.yaml"


@pytest.mark.parametrize("yaw", np.radians([-80.0, -30.0, 0.0, 20.0, 65.0]))
def test_a_depth_image_tells_how_a_part_lies(yaw):
    box = Box(x=0.47, y=0.02, yaw=float(yaw), size=(0.06, 0.03, 0.025))
    seen = frame([box])
    found = seen_footprint(seen, table_z=TABLE_Z, region=REGION, min_height=0.002)
    assert abs(wrap_half_turn(np.asarray(found.theta - yaw))) < np.radians(3.0)
    np.testing.assert_allclose(found.sides, [0.06, 0.03], atol=0.003)


def test_a_low_part_of_it_counts_too():
    """A bracket: a plate of 4 mm with a wall of 40 mm."""
    plate = Box(x=0.47, y=0.0, yaw=0.5, size=(0.08, 0.03, 0.004))
    wall = Box(x=0.47 + 0.038 * np.cos(0.5), y=0.038 * np.sin(0.5), yaw=0.5, size=(0.004, 0.03, 0.04))
    seen = frame([plate, wall])
    found = seen_footprint(seen, table_z=TABLE_Z, region=REGION, min_height=0.002)
    assert abs(found.theta - 0.5) < np.radians(3.0)
    np.testing.assert_allclose(found.sides, [0.08, 0.03], atol=0.003)


def test_the_footprint_of_a_rectangle_is_itself():
    corners = np.array([[1, 2], [1, -2], [-1, -2], [-1, 2]]) * 0.01
    cos, sin = np.cos(0.4), np.sin(0.4)
    found = footprint_of(corners @ np.array([[cos, sin], [-sin, cos]]) + [0.5, 0.1])
    np.testing.assert_allclose(found.sides, [0.04, 0.02], atol=1e-6)
    assert abs(wrap_half_turn(np.asarray(found.theta - (0.4 + np.pi / 2)))) < 1e-5


def test_both_ways_round_differ_by_half_a_turn_and_the_first_turns_less():
    slot = Slot(x=0.5, y=0.1, theta=0.2)
    for lies in (-1.4, 0.2, 0.3, 1.1):
        first, second = slot.targets(Footprint(sides=np.array([0.06, 0.03]), theta=lies))
        assert abs(wrap_half_turn(np.asarray(lies + first.theta - slot.theta))) < 1e-9
        assert abs(abs(first.theta - second.theta) - np.pi) < 1e-9
        assert abs(first.theta) <= np.pi / 2 + 1e-9


def test_a_turned_part_needs_other_room():
    lies = Footprint(sides=np.array([0.08, 0.02]), theta=0.0)
    assert Slot(x=0, y=0, theta=0.0, size=(0.081, 0.021)).fits(lies)
    assert not Slot(x=0, y=0, theta=np.pi / 2, size=(0.081, 0.021)).fits(lies)
    assert not Slot(x=0, y=0, theta=np.pi / 4, size=(0.07, 0.07)).fits(lies)
    assert Slot(x=0, y=0, theta=np.pi / 4).fits(lies)


def test_the_shipped_grid_is_reached_by_its_cell():
    slots = read_slots(GRID)
    assert len(slots) == 6 and len({(slot.x, slot.y) for slot in slots}) == 6
    check_reach(cell_from_yaml(REPOSITORY / "configs" / "palletize" / "cell.yaml"), slots)


def test_a_slot_out_of_reach_is_named():
    cell = cell_from_yaml(REPOSITORY / "configs" / "cells" / "sapien.yaml")
    with pytest.raises(UsageError, match=r"slot 2 at \(0.9, 0\) m .*outside the workspace"):
        check_reach(cell, [parse_target("0.5,0,0"), parse_target("0.9,0,0")])


def test_a_slot_smaller_than_a_part_is_named_with_both_sizes():
    part = find_part("hex_bolt_m12x60")
    long, short = 1e3 * usual_footprint(part).sides
    assert 60 < long < 75 and 15 < short < 25  # ISO 4017: head 7.5 high and 18 wide, shank 60 long
    with pytest.raises(
        UsageError, match=r"a slot of 50 x 50 mm is smaller than hex_bolt_m12x60 \(68 x \d+ mm\)"
    ):
        check_room([(part, Slot(x=0.5, y=0.0, theta=0.0, size=(0.05, 0.05)))])
    check_room([(part, Slot(x=0.5, y=0.0, theta=0.0, size=(0.08, 0.05)))])


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("{}", UsageError, "holds no slot"),
        ("slots: [{x: 0.5}]", BadConfig, "'slots.0.y': field required"),
        ("slots: [{x: 0.5, y: .nan}]", BadConfig, "finite"),
        ("slots: [{x: 0.5, y: 0, size: [0.1, -0.1]}]", BadConfig, "greater than 0"),
        ("grid: {first: [0.4, 0.2], pitch: [0.1, 0.1], n: [0, 2]}", BadConfig, "greater than or equal to 1"),
        ("grid: {first: [0.4, 0.2], pitch: [0.1, 0.1], n: [3000, 2000]}", BadConfig, "less than or equal to"),
        ("grid: {first: [0.4, 0.2], pitch: [0.05, 0.05], n: [2, 2], size: [0.06, 0.04]}", BadConfig, "lap"),
        ("- {x: 0.5, y: 0.1}", BadConfig, "expected a mapping"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_one_line(tmp_path, text, error, message):
    path = tmp_path / "slots.yaml"
    path.write_text(text)
    with pytest.raises(error, match=message) as caught:
        read_slots(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["0.5,0.1", "a,b,c", "0.5,nan,0", "0.5 0.1 0"])
def test_a_wrong_target_is_refused(text):
    with pytest.raises(ValueError, match="target must be"):
        parse_target(text)
