"""Command ``rate``: success rate of each part in random grasps, from a collected dataset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mskgrasp.parts.catalogue import read_index, with_ratings, write_index


@dataclass(frozen=True, kw_only=True)
class Rate:
    """Store each part's success rate in random grasps, from a dataset, in the index of the catalogue.

    Collection and training can filter by it, as in the paper: 5 to 40 %.
    Example: python -m mskgrasp.parts rate --data data/rating
    """

    data: Path
    """Folder of a dataset made by mskgrasp.collect."""
    low: float = 0.05
    """Least success rate that the report counts as graspable; the index stores the numbers unfiltered."""
    high: float = 0.40
    """Greatest success rate that the report does not count as too easy."""


def run_rate(command: Rate) -> int:
    """Rates the parts; prints families and an estimate for the parts without grasps."""
    # Datasets are on a floor above parts; only this command uses them.
    from mskgrasp.dataset.rating import draw_ratings, rate_parts, report

    found = rate_parts(command.data)
    index = with_ratings(read_index(), found)
    write_index(index)
    report(index, (command.low, command.high))
    print(f"wrote {draw_ratings(index, (command.low, command.high), command.data / 'rating.png')}")
    print(f"{len(found)} parts rated")
    return 0
