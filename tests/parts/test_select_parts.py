"""Which parts a user's words mean, and how some of them are chosen."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UnknownPart
from mskgrasp.parts.select_parts import evenly, part_names

TRAINING = {
    "training_parts": ["hex_nut_m30", "hex_nut_m20", "washer_m36"],
    "validation_parts": ["hinge_60x30", "t_nut_m16x18"],
}


def test_few_parts_are_spread_and_more_include_them():
    names = [f"p{k:03d}" for k in range(300)]
    ten = evenly(names, 10)
    places = [int(name[1:]) for name in ten]
    assert max(b - a for a, b in zip(places, [*places[1:], 300], strict=True)) <= 60
    for n in range(1, 60):
        assert len(evenly(names, n)) == n and set(evenly(names, n)) <= set(evenly(names, n + 1))
    assert evenly(["b", "a"], 5) == ["a", "b"]


def test_sets_are_those_of_the_model_and_share_the_number_of_parts():
    assert part_names(("train",), TRAINING) == TRAINING["training_parts"]
    assert part_names(("validation", "hex_nut_m30"), TRAINING)[-1] == "hex_nut_m30"
    assert len(part_names(("train", "validation"), TRAINING, 2)) == 2
    found = part_names(("train", "validation"), TRAINING, 4)
    assert len(found) == 4 and set(found) > set(TRAINING["validation_parts"])
    assert set(part_names(("train", "validation"), TRAINING, 50)) == {
        *TRAINING["training_parts"], *TRAINING["validation_parts"]
    }  # fmt: skip


def test_an_unknown_part_is_told():
    with pytest.raises(UnknownPart, match="hex_nut_m30"):
        part_names(("hex_nut_m3x",), TRAINING)
