"""The frozen list keeps what the benchmark promises of it."""

from __future__ import annotations

import json
from collections import Counter

from mskgrasp.benchmark.part_list import benchmark_parts
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import DESCRIPTION
from mskgrasp.parts.builtin import builtin_names
from mskgrasp.parts.catalogue import split_of

PARTS = benchmark_parts()


def test_there_are_60_parts_of_the_catalogue_and_20_are_standard():
    names = [part.name for part in PARTS]
    assert len(names) == len(set(names)) == 60 and set(names) <= set(builtin_names())
    assert sum(part.standard.startswith(("ISO", "DIN", "EN")) for part in PARTS) == 20
    standard = {part.family for part in PARTS if part.standard}
    assert len({part.family for part in PARTS} - standard) == 26


def test_no_model_was_trained_on_them():
    training = json.loads((PRETRAINED / DESCRIPTION).read_text())["training"]
    assert not {part.name for part in PARTS} & set(training["training_parts"])
    # Whole families are held out, but for a few standard parts in sizes that are.
    families = {split_of(part.family, part.name) for part in PARTS if part.split == "test"}
    assert families == {"test"}
    known = [part for part in PARTS if part.split == "new_sizes"]
    assert len(known) == 5 and all(part.standard for part in known)


def test_no_family_prevails():
    assert max(Counter(part.family for part in PARTS).values()) <= 4


def test_a_few_parts_are_chosen_evenly_and_always_the_same():
    few = benchmark_parts(12)
    assert len(few) == 12 and few == benchmark_parts(12) and set(few) <= set(benchmark_parts(20))
    assert any(part.standard for part in few) and not all(part.standard for part in few)
