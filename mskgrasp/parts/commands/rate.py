"""The verb ``rate``: how easily each part is grasped, from a collected dataset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mskgrasp.parts.catalogue import read_index, with_ratings, write_index


@dataclass(frozen=True, kw_only=True)
class Rate:
    """Take each part's share of successful random grasps from a dataset into the catalogue's index.

    Collection and training filter by it, as the paper did: 5 to 40 %.
    Example: python -m mskgrasp.parts rate --data data/rating
    """

    data: Path
    """Folder of a dataset made by mskgrasp.collect."""
    low: float = 0.05
    """Least share of successes that counts as neither too hard ..."""
    high: float = 0.40
    """... nor, above this one, too easy; both for the report alone, the index keeps the numbers."""


def run_rate(verb: Rate) -> int:
    """Rates, prints families and an estimate for the parts that were not grasped."""
    # Datasets are above the vocabulary; this verb alone looks up to them.
    from mskgrasp.dataset.rating import draw_ratings, rate_parts, report

    found = rate_parts(verb.data)
    index = with_ratings(read_index(), found)
    write_index(index)
    report(index, (verb.low, verb.high))
    print(f"wrote {draw_ratings(index, (verb.low, verb.high), verb.data / 'rating.png')}")
    print(f"{len(found)} parts rated")
    return 0
