"""Frozen list of the benchmark's parts; `tests/benchmark/choose_parts.py` states how it was chosen."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.parts.select_parts import evenly

LIST = Path(__file__).with_name("parts.csv")


@dataclass(frozen=True, kw_only=True)
class BenchmarkPart:
    """A part of the list.

    Attributes:
        name: Name in the catalogue.
        family: Kind of part.
        split: ``test``, or ``new_sizes`` of a family whose other sizes models are trained on.
        standard: Standard by which it can be bought; empty: a part of own dimensions.
    """

    name: str
    family: str
    split: str
    standard: str


def benchmark_parts(n: int = 0) -> list[BenchmarkPart]:
    """The parts in the order of the list; the first so many of an even choice where n is positive."""
    with open(LIST, encoding="utf-8", newline="") as file:
        parts = [BenchmarkPart(**row) for row in csv.DictReader(file)]
    if not n:
        return parts
    chosen = set(evenly([part.name for part in parts], n))
    return [part for part in parts if part.name in chosen]
