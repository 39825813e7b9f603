"""What a collection run found: a table for the reader, JSON for programs, a picture to look at."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mskgrasp.collect.config import PartFilter
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.metrics import wilson_interval
from mskgrasp.dataset import ShardInfo, list_shards, read_shard
from mskgrasp.dataset.shards import read_columns
from mskgrasp.reports.grasp_figures import draw_contact_sheet

N_PICTURES = 24

Columns = dict[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class PartSummary:
    """One part's attempts in numbers.

    Attributes:
        part: Name.
        family: Kind of part.
        attempts: How many.
        successes: How many lifted the part.
        success_interval: 95 % Wilson interval of the success rate.
        median_displacement: Median of |d| over successes, metres; None without any.
        median_turn: Median of |dtheta| over successes, radians; None without any.
        median_tilt: Median tilt over successes, radians; None without any.
        failures: Count for each reason.
        discarded: Attempts thrown away, by reason.
        kept: Whether the part passes the filter on its success rate.
    """

    part: str
    family: str
    attempts: int
    successes: int
    success_interval: tuple[float, float]
    median_displacement: float | None
    median_turn: float | None
    median_tilt: float | None
    failures: dict[str, int]
    discarded: dict[str, int]
    kept: bool


def summarise(folder: Path, part_filter: PartFilter) -> list[PartSummary]:
    """Reads a dataset and sums up each part."""
    parts: dict[str, list[tuple[Columns, ShardInfo]]] = {}
    for path in list_shards(folder):
        # Without the images: those of a large dataset do not fit into memory.
        columns, info = read_columns(path, ("success", "failure", "displacement", "tilt"))
        parts.setdefault(info.part, []).append((columns, info))
    return [_sum_up(name, shards, part_filter) for name, shards in sorted(parts.items())]


def _sum_up(name: str, shards: list[tuple[Columns, ShardInfo]], part_filter: PartFilter) -> PartSummary:
    success, failure, displacement, tilt = (
        np.concatenate([columns[name] for columns, _ in shards])
        for name in ("success", "failure", "displacement", "tilt")
    )
    displacement, tilt = displacement[success], tilt[success]
    discarded: Counter[str] = Counter()
    for _, info in shards:
        discarded.update(info.discarded)
    rate = float(success.mean()) if len(success) else 0.0
    return PartSummary(
        part=name,
        family=shards[0][1].family,
        attempts=len(success),
        successes=int(success.sum()),
        success_interval=tuple(wilson_interval(int(success.sum()), len(success))),  # type: ignore[arg-type]
        median_displacement=_median(np.linalg.norm(displacement[:, :3], axis=1)),
        median_turn=_median(np.abs(displacement[:, 3])),
        median_tilt=_median(tilt),
        failures={FAILURES[code]: int(n) for code, n in enumerate(np.bincount(failure)) if code and n},
        discarded=dict(discarded),
        kept=part_filter.takes_success(rate),
    )


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if len(values) else None


def print_table(summaries: list[PartSummary], console: Console) -> None:
    """A row a part, and the sum of all."""
    table = Table(title="Random grasps by part")
    for column, justify in (
        ("part", "left"), ("attempts", "right"), ("success", "right"), ("95 % interval", "right"),
        ("|d| median", "right"), ("|turn| median", "right"), ("failures", "left"), ("kept", "left"),
    ):  # fmt: skip
        table.add_column(column, justify=justify, no_wrap=column != "failures")  # type: ignore[arg-type]
    for row in summaries:
        low, high = row.success_interval
        table.add_row(
            row.part,
            str(row.attempts),
            f"{row.successes / max(row.attempts, 1):.1%}",
            f"{low:.0%} - {high:.0%}",
            "-" if row.median_displacement is None else f"{row.median_displacement * 1e3:.1f} mm",
            "-" if row.median_turn is None else f"{np.degrees(row.median_turn):.1f} deg",
            _counts({**row.failures, **row.discarded}),
            "yes" if row.kept else "no",
        )
    attempts, successes = sum(r.attempts for r in summaries), sum(r.successes for r in summaries)
    failures = sum((Counter(row.failures) for row in summaries), Counter())
    table.add_section()
    table.add_row(
        f"all {len(summaries)}", str(attempts), f"{successes / max(attempts, 1):.1%}", "", "", "",
        _counts(failures), str(sum(row.kept for row in summaries)),
    )  # fmt: skip
    console.print(table)


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {n}" for name, n in sorted(counts.items(), key=lambda item: -item[1]))


def write_summary(summaries: list[PartSummary], folder: Path) -> None:
    """``summary.json``: the table's numbers."""
    text = json.dumps({"schema_version": 1, "parts": [asdict(row) for row in summaries]}, indent=1)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")


def draw_summary(folder: Path, seed: int) -> Path:
    """``summary.png``: attempts of many parts, successes and failures mixed."""
    paths = list_shards(folder)
    rng = np.random.default_rng(seed)
    chosen = rng.permutation(len(paths))[:N_PICTURES]
    rows = []
    for k in range(N_PICTURES):
        attempts, info = read_shard(paths[chosen[k % len(chosen)]])
        # Every second picture shows a success where the shard has one: they carry the arrows.
        candidates = np.flatnonzero(attempts.success if k % 2 == 0 else ~attempts.success)
        if not len(candidates):
            candidates = np.arange(len(attempts))
        if len(candidates):
            rows.append((attempts, info, int(rng.choice(candidates))))
    path = folder / "summary.png"
    n_parts = len({path.name.rsplit("-", 1)[0] for path in paths})
    draw_contact_sheet(rows, path, title=f"Random grasps of {n_parts} parts, seen from above")
    return path
