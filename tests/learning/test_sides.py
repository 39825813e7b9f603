"""Parts to train on, to select by, and to measure on."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from mskgrasp.core.errors import BadDataset
from mskgrasp.learning.sides import split
from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import Index, entry_of, make_index, write_index
from mskgrasp.parts.recipes import cad
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
