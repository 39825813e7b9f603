"""Versions in the hashes of recipes: those of the first parts stay, and a raised number changes them."""

import pytest

from mskgrasp.parts import builtin, builtin_names, versions
from mskgrasp.parts.builtin import recipe_hash
from mskgrasp.parts.versions import stamp


def test_version_1_has_the_stamp_of_the_first_parts_and_later_ones_their_number():
    assert len(stamp("part", 1)) == 64 and stamp("part", 2) == "2"
    assert stamp("families.not_there_at_first", 1) == "1"


def test_a_raised_version_makes_every_part_out_of_date(monkeypatch: pytest.MonkeyPatch):
    before = recipe_hash("washer_m36")
    monkeypatch.setattr(builtin, "PART_VERSION", versions.PART_VERSION + 1)
    assert recipe_hash("washer_m36") != before


def test_parts_made_before_versions_were_numbered_are_those_of_version_1(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(builtin, "PART_VERSION", 1)
    # Read from part.json files written then.
    made = {
        "bearing_6202": "b89b85b0b7ddacce9f8318cc9fdf7aaf50ad6c744c521d2630a6392a9fcc20be",
        "hex_nut_m30": "b9db09476e127f47e8ec7795ec87d0d0c6e6e1f2c29e481eff78bea91dd852f7",
        "l_bracket_40x40": "9a0c6a1beefdce99e373e245ce701407f585fb3b8b0367b21527c0362017ffd7",
        "pillow_block_80x32": "abdf023b8e59f20cceb318d1d57c7de15127628a294293a569272ba1e43c1e92",
        "spur_gear_m2_z18": "af95c084338c8e9eb27b2386d9ed610b2c17107b499955f523a7cdcf2241d657",
    }
    assert {name: recipe_hash(name) for name in made if name in builtin_names()} == {
        name: digest for name, digest in made.items() if name in builtin_names()
    }
