"""Command ``rate``: success rate of each part in random grasps, from a collected dataset."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import UsageError
from mskgrasp.core.metrics import share_interval
from mskgrasp.parts.catalogue import Entry, Index, read_index, with_ratings, write_index
from mskgrasp.runtime.console_table import Table, print_table


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
    """Rate the parts; print families and an estimate for the parts without grasps.

    Raises:
        UsageError: The bounds are not shares in increasing order.
        BadDataset: The folder holds no dataset.
        BadPart: A part is not in the catalogue, or has changed since it was grasped.
    """
    if not 0 <= command.low < command.high <= 1:
        raise UsageError(f"--low {command.low} --high {command.high}: give 0 <= low < high <= 1")
    # Matplotlib and h5py take a second to load; the other commands do not need them.
    from mskgrasp.dataset.rating import draw_ratings, rate_parts

    found = rate_parts(command.data)
    index = with_ratings(read_index(), found)
    write_index(index)
    _report(index, command.low, command.high)
    print(f"wrote {draw_ratings(index, (command.low, command.high), command.data / 'rating.png')}")
    print(f"{len(found)} parts rated")
    return 0


def _report(index: Index, low: float, high: float) -> None:
    """Print the rated families, and the number of parts between the bounds."""
    from mskgrasp.dataset.rating import passing

    families: dict[str, list[Entry]] = defaultdict(list)
    for entry in index.parts.values():
        families[entry.family].append(entry)
    header = (
        "family",
        "parts",
        "rated",
        "grasps",
        "success",
        "95 % interval",
        f"within {low:.0%} - {high:.0%}",
    )
    rows = []
    for family, entries in sorted(families.items()):
        rated = [entry.rating for entry in entries if entry.rating is not None]
        if not rated:
            continue
        n, won = sum(r.attempts for r in rated), sum(r.successes for r in rated)
        # By parts: grasps of one part are alike.
        interval = share_interval(
            np.array([r.successes for r in rated]), np.array([r.attempts for r in rated])
        )
        rows.append((
            family, len(entries), len(rated), n, f"{won / max(n, 1):.0%}",
            f"{interval[0]:.0%} - {interval[1]:.0%}",
            f"{sum(low <= r.rate <= high for r in rated)} of {len(rated)}",
        ))  # fmt: skip
    print_table(Table(header=header, rows=rows))
    n_rated = sum(entry.rating is not None for entry in index.parts.values())
    if n_rated >= 2:
        inside, expected, error = passing(index, low, high)
        print(
            f"{inside} of {n_rated} rated parts lie within {low:.0%} - {high:.0%}; of all "
            f"{len(index.parts)} parts of the catalogue an estimated {expected:.0f} do (95 %: "
            f"{max(0.0, expected - 1.96 * error):.0f} - {expected + 1.96 * error:.0f})"
        )
