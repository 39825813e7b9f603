"""Parts that names, folders and sets select, and how some of many are chosen."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from mskgrasp.core.errors import UnknownPart, UsageError
from mskgrasp.parts import build_part, find_part, starter_names
from mskgrasp.parts.catalogue import entry_of, make_index, read_index, write_index
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


def test_a_set_may_have_a_number_of_its_own():
    found = part_names(("train:2", "validation:1"), TRAINING)
    assert found == [*evenly(TRAINING["training_parts"], 2), *evenly(TRAINING["validation_parts"], 1)]
    with pytest.raises(UsageError, match="--parts train:4: train has 3 parts; legal: 1 to that number"):
        part_names(("train:4",), TRAINING)


@pytest.mark.parametrize("word", ["train:x", "starter:", "test:3.5"])
def test_what_is_no_number_after_a_set_is_named(word: str):
    with pytest.raises(UsageError, match=f"--parts {word}: after the colon comes a number, as in train:50"):
        part_names((word,), TRAINING)


def test_a_file_of_names_is_those_parts(tmp_path: Path):
    (tmp_path / "known.txt").write_text("hex_nut_m30\n\nwasher_m36\n")
    words = (str(tmp_path / "known.txt"), "validation:1")
    assert part_names(words, TRAINING)[:2] == ["hex_nut_m30", "washer_m36"]
    with pytest.raises(UsageError, match="cannot read the names in .*none.txt"):
        part_names((str(tmp_path / "none.txt"),), TRAINING)


def test_an_unknown_part_is_an_error_that_names_a_similar_one():
    with pytest.raises(UnknownPart, match="hex_nut_m30"):
        part_names(("hex_nut_m3x",), TRAINING)


@pytest.mark.slow
def test_a_held_out_set_of_the_catalogue_leaves_out_what_the_model_was_trained_on():
    names = ("l_bracket_40x40", "shaft_collar_25", "hex_nut_m20")  # two of the side "test", one of "train"
    for name in names:
        build_part(name)
    write_index(make_index([entry_of(name) for name in names], {}, read_index()))
    assert part_names(("test",), {}) == ["l_bracket_40x40", "shaft_collar_25"]
    assert part_names(("test",), {"training_parts": ["shaft_collar_25"]}) == ["l_bracket_40x40"]
    assert part_names(("test",), {"validation_parts": ["shaft_collar_25"]}) == ["l_bracket_40x40"]
    assert part_names(("train",), {}) == ["hex_nut_m20"]


def test_all_is_the_starter_set_and_a_part_named_twice_counts_once(
    shared_cache: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(shared_cache))
    assert part_names(("all", "washer_m36"), {}, 0) == list(starter_names())


def test_two_parts_of_one_name_are_refused(tmp_path: Path):
    copy = shutil.copytree(find_part("hex_nut_m30").folder, tmp_path / "hex_nut_m30")
    with pytest.raises(UsageError, match="both called 'hex_nut_m30'"):
        part_names(("hex_nut_m30", str(copy)), TRAINING)
