"""Slots: their file, the parts that fit, and the reach of the arm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hal import cell_from_yaml
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.pallet_slots import (
    Slot,
    check_parts_beside_region,
    check_room,
    check_slots_beside_region,
    check_slots_in_reach,
    chosen_slots,
    read_slots,
)
from mskgrasp.parts import find_part
from mskgrasp.perception.footprint import Footprint, usual_footprint

REPOSITORY = Path(__file__).parents[2]
GRID = REPOSITORY / "configs" / "palletize" / "grid.yaml"


def test_both_targets_differ_by_half_a_turn_and_the_first_turns_less():
    slot = Slot(x=0.5, y=0.1, theta=0.2)
    for direction in (-1.4, 0.2, 0.3, 1.1):
        first, second = slot.targets(Footprint(sides=np.array([0.06, 0.03]), theta=direction))
        assert abs(wrap_half_turn(np.asarray(direction + first.theta - slot.theta))) < 1e-9
        assert abs(abs(first.theta - second.theta) - np.pi) < 1e-9
        assert abs(first.theta) <= np.pi / 2 + 1e-9


def test_a_turned_slot_needs_another_size():
    footprint = Footprint(sides=np.array([0.08, 0.02]), theta=0.0)
    assert Slot(x=0, y=0, theta=0.0, size=(0.081, 0.021)).fits(footprint)
    assert not Slot(x=0, y=0, theta=np.pi / 2, size=(0.081, 0.021)).fits(footprint)
    assert not Slot(x=0, y=0, theta=np.pi / 4, size=(0.07, 0.07)).fits(footprint)
    assert Slot(x=0, y=0, theta=np.pi / 4).fits(footprint)


def test_a_single_target_is_the_only_slot_and_a_file_takes_its_place(tmp_path):
    (slot,) = chosen_slots(PalletizeConfig(target="0.55,-0.1,30"))
    assert (slot.x, slot.y, slot.size) == (0.55, -0.1, None) and slot.theta == pytest.approx(np.pi / 6)
    path = tmp_path / "slots.yaml"
    path.write_text("slots: [{x: 0.5, y: 0.2}, {x: 0.4, y: 0.2}]")
    assert [slot.x for slot in chosen_slots(PalletizeConfig(slots=path))] == [0.5, 0.4]


def test_the_shipped_grid_is_within_reach_of_its_cell():
    slots = read_slots(GRID)
    assert len(slots) == 6 and len({(slot.x, slot.y) for slot in slots}) == 6
    cell = cell_from_yaml(REPOSITORY / "configs" / "palletize" / "cell.yaml")
    check_slots_in_reach(cell, slots)
    check_slots_beside_region(cell, slots)


def test_a_slot_that_reaches_into_the_region_of_the_next_part_is_named():
    cell = cell_from_yaml(REPOSITORY / "configs" / "cells" / "sapien.yaml")
    x_min, x_max, y_min, y_max = cell.workspace.region
    beside = Slot(x=0.5, y=y_min - 0.05, theta=0.0)
    check_slots_beside_region(cell, [beside, Slot(x=x_max + 0.04, y=y_max + 0.04, theta=0.0)])
    for x, y in ((0.5, 0.0), (0.5, y_min - 0.049), (x_min - 0.03, y_max + 0.03)):
        with pytest.raises(UsageError, match=r"slot 2 at .* is nearer than 0.05 m to the region"):
            check_slots_beside_region(cell, [beside, Slot(x=x, y=y, theta=0.0)])


def test_a_slots_edge_is_what_is_kept_away_from_the_region_of_the_next_part():
    """A part that fills the slot would be detected beside every following one."""
    cell = cell_from_yaml(REPOSITORY / "configs" / "cells" / "sapien.yaml")
    _, x_max, _, y_max = cell.workspace.region
    check_slots_beside_region(cell, [Slot(x=0.5, y=y_max + 0.1, theta=0.0, size=(0.2, 0.1))])
    for x, y in ((0.5, y_max + 0.099), (x_max + 0.12, y_max + 0.07)):
        with pytest.raises(UsageError, match=r"slot 1 at .* is nearer than 0.05 m to the region"):
            check_slots_beside_region(cell, [Slot(x=x, y=y, theta=0.0, size=(0.2, 0.1))])


def test_a_slot_without_a_size_is_as_large_as_the_part_that_is_placed_there():
    cell = cell_from_yaml(REPOSITORY / "configs" / "cells" / "sapien.yaml")
    part = find_part("hex_bolt_m12x60")  # about 68 x 20 mm
    y = cell.workspace.region[3] + 0.07
    check_parts_beside_region(cell, [(part, Slot(x=0.5, y=y, theta=0.0))])
    for slot in (Slot(x=0.5, y=y, theta=np.pi / 2), Slot(x=0.5, y=y - 0.015, theta=0.0)):
        with pytest.raises(UsageError, match=r"hex_bolt_m12x60 in the slot at .* is nearer than 0.05 m"):
            check_parts_beside_region(cell, [(part, slot)])


def test_a_slot_out_of_reach_is_named():
    cell = cell_from_yaml(REPOSITORY / "configs" / "cells" / "sapien.yaml")
    with pytest.raises(UsageError, match=r"slot 2 at \(0.9, 0\) m .*outside the workspace"):
        check_slots_in_reach(cell, [Slot(x=0.5, y=0.0, theta=0.0), Slot(x=0.9, y=0.0, theta=0.0)])


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
        ("slots: [{x: 0.5, y: 0.2}, {x: 0.4, y: 0.2}, {x: 0.5, y: 0.2}]", UsageError,
         r"slot 1 at \(0.5, 0.2\) m and slot 3 at \(0.5, 0.2\) m overlap"),
        ("{grid: {first: [0.4, 0.2], pitch: [0.1, 0.1], n: [3, 2]},"
         " slots: [{x: 0.3, y: 0.2, size: [0.1, 0.1]}, {x: 0.64, y: 0.26, size: [0.1, 0.1]}]}", UsageError,
         r"slot 3 at \(0.6, 0.2\) m and slot 8 at \(0.64, 0.26\) m overlap"),
    ],
)  # fmt: skip
def test_an_invalid_file_is_an_error_of_one_line(tmp_path, text, error, message):
    path = tmp_path / "slots.yaml"
    path.write_text(text)
    with pytest.raises(error, match=message) as caught:
        read_slots(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
