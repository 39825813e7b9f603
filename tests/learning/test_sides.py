"""Parts to train on, to select by, and to measure on."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from mskgrasp.core.errors import BadDataset
from mskgrasp.learning.sides import part_sides, split
from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import Index, entry_of, make_index, split_of, write_index
from mskgrasp.parts.recipes import cad, families
from tests.learning.small import PATCH


def test_validation_never_sees_a_part_of_training(samples):
    sides = split(samples, PATCH)
    assert not set(samples.part[sides.training].tolist()) & set(samples.part[sides.validation].tolist())
    assert len(sides.training) + len(sides.validation) == len(samples) and not len(sides.test)


@pytest.mark.parametrize(("success", "words"), [(True, "no failure"), (False, "no success")])
def test_data_of_one_outcome_are_reported(samples, success, words):
    alike = dataclasses.replace(samples, success=torch.full((len(samples),), success))
    with pytest.raises(BadDataset, match=words):
        split(alike, PATCH)


def test_test_parts_that_are_never_lifted_are_left_out_and_named(samples, monkeypatch, capsys):
    names = {name: ("train", "validation", "test")[min(k, 2)] for k, name in enumerate(samples.parts)}
    monkeypatch.setattr("mskgrasp.learning.sides.part_sides", lambda *_: names)
    test = samples.part >= 2
    assert len(samples.parts) > 2
    for success in (samples.success, samples.success | test):  # displacements are measured of successes alone
        assert len(split(dataclasses.replace(samples, success=success), PATCH).test) == int(test.sum())
    assert not capsys.readouterr().err
    assert not len(split(dataclasses.replace(samples, success=samples.success & ~test), PATCH).test)
    assert f"no success among the {int(test.sum())} attempts at the test parts" in capsys.readouterr().err


def test_parts_that_the_catalogue_lacks_are_counted(samples, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    write_index(make_index([entry_of(build_part("washer_m36").name)], {}, Index(parts={}, left_out={})))
    drawn = sorted(recipe.name for recipe in cad.recipes())[0]
    renamed = dataclasses.replace(samples, parts=("washer_m36", drawn, *samples.parts[2:]))
    split(renamed, PATCH.model_copy(update={"sides": "catalogue"}))
    said = capsys.readouterr().err
    assert f"1 of 8 parts are not in the catalogue of this machine ({drawn}): their families decide" in said
    assert "6 of 8 parts are not" in said and ", ...): their names decide on which side they are" in said
    split(renamed, PATCH)
    assert not capsys.readouterr().err


def held_out_of(names: tuple[str, ...], fraction: float) -> set[str]:
    return {name for name, side in part_sides(names, fraction, "name").items() if side == "validation"}


def test_parts_are_split_by_name_and_stay_on_their_side():
    names = tuple(f"part_{k}" for k in range(400))
    held_out = held_out_of(names, 0.2)
    assert 50 < len(held_out) < 110
    fewer = names[:200]
    assert held_out_of(fewer, 0.2) == held_out & set(fewer)
    assert all(len(held_out_of(("a", "b"), share)) == 1 for share in (0.01, 0.99))
    with pytest.raises(BadDataset, match="at least 2 parts"):
        part_sides(("lonely",), 0.2, "name")


def test_the_catalogue_decides_the_sides_where_it_is_asked_to(monkeypatch, tmp_path):
    names = tuple(f"part_{k}" for k in range(6))
    with pytest.raises(BadDataset, match="build --catalogue"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        part_sides(names, 0.2, "catalogue")


def test_parts_that_were_not_built_here_are_on_the_side_of_their_family(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    write_index(make_index([entry_of(build_part("washer_m36").name)], {}, Index(parts={}, left_out={})))
    drawn = {recipe.name: split_of(recipe.family, "group 0") for recipe in cad.recipes()}
    sides = part_sides(("washer_m36", *drawn), 0.2, "catalogue")
    assert sides["washer_m36"] == split_of("washer", "washer_m36")
    for side in ("test", "validation"):
        assert {name for name in drawn if sides[name] == side} == {
            n for n, one in drawn.items() if one == side
        }


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """Names of parts by their side of the catalogue, of which one part is built."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("catalogue")))
        write_index(make_index([entry_of(build_part("washer_m36").name)], {}, Index(parts={}, left_out={})))
        names: dict[str, list[str]] = {}
        for recipe in families.recipes().values():
            names.setdefault(split_of(recipe.family, recipe.name), []).append(recipe.name)
        yield names


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        ({"train": 1, "test": 3}, "validation"),
        ({"test": 3}, "validation"),
        ({"new_sizes": 1, "test": 2}, "validation"),
        ({"validation": 1, "test": 3}, "train"),
        ({"validation": 3}, "train"),
        ({"train": 1, "new_sizes": 1}, "validation"),
        ({"new_sizes": 2}, "validation"),
    ],
    ids=str,
)
def test_a_side_without_parts_takes_none_of_the_held_out_families(named, numbers, missing):
    parts = tuple(name for side, n in numbers.items() for name in named[side][:n])
    with pytest.raises(BadDataset, match=f"no part is left for {missing} .*--parts {missing}, too"):
        part_sides(parts, 0.2, "catalogue")


def test_a_side_without_parts_takes_one_that_may_be_trained_on(named):
    held_out = {name: "test" for name in named["test"][:5]} | {named["new_sizes"][0]: "new_sizes"}
    others = tuple(named["train"][:2])
    sides = part_sides((*held_out, *others), 0.2, "catalogue")
    assert held_out.items() <= sides.items()
    assert {sides[name] for name in others} == {"train", "validation"}
