"""Summary of a collection run: table, JSON and picture."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from mskgrasp.collect.config import PartFilter
from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.metrics import wilson_interval
from mskgrasp.dataset import ShardInfo, list_shards, read_shard
from mskgrasp.dataset.shards import read_columns, success_rate
from mskgrasp.planning.grasp_figures import draw_contact_sheet
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Section
from mskgrasp.runtime.console_table import Table

N_PICTURES = 24
_HEADER = (
    "part", "attempts", "success", "95 % interval", "median displacement", "median turn", "failures",
    "discarded attempts", "passes the part filter",
)  # fmt: skip
_EXPLAINED = (
    "Success: share of the attempts that lifted the part. Median displacement and turn: of the part in the "
    "hand, over the attempts that lifted it. Discarded attempts are not counted; a scene whose part was "
    "not at rest was drawn again first, several times. The part filter compares the success in a part's "
    "first shard with part_filter.min_success and max_success."
)

Columns = dict[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class PartSummary:
    """Attempts on one part in numbers.

    Attributes:
        part: Name of the part.
        family: Family of the part.
        attempts: Number of attempts.
        successes: Number of those that lifted the part.
        success_interval: 95 % Wilson interval of the success rate.
        median_displacement: Median of |d| over successes, metres; None without any.
        median_turn: Median of |dtheta| over successes, radians; None without any.
        median_tilt: Median tilt over successes, radians; None without any.
        failures: Number of failures by reason.
        discarded: Number of discarded attempts by reason; not among the attempts.
        redrawn: Number of scenes drawn again because the part was not at rest.
        kept: Whether the part passes the filter on the success rate of its first shard.
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
    redrawn: int
    kept: bool


def summarise_parts(folder: Path, part_filter: PartFilter) -> list[PartSummary]:
    """Read a dataset and summarise each part."""
    parts: dict[str, list[tuple[Columns, ShardInfo]]] = {}
    for path in list_shards(folder):
        # Without the images: those of a large dataset do not fit into memory.
        columns, info = read_columns(path, ("success", "failure", "displacement", "tilt"))
        parts.setdefault(info.part, []).append((columns, info))
    return [_summarise_part(name, shards, part_filter) for name, shards in sorted(parts.items())]


def _summarise_part(
    name: str, shards: list[tuple[Columns, ShardInfo]], part_filter: PartFilter
) -> PartSummary:
    success, failure, displacement, tilt = (
        np.concatenate([columns[name] for columns, _ in shards])
        for name in ("success", "failure", "displacement", "tilt")
    )
    displacement, tilt = displacement[success], tilt[success]
    first = next((columns["success"] for columns, info in shards if info.index == 0), success)
    discarded: Counter[str] = Counter()
    for _, info in shards:
        discarded.update(info.discarded)
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
        redrawn=sum(info.redrawn for _, info in shards),
        kept=part_filter.takes_success(success_rate(first)),
    )


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if len(values) else None


def print_summary(summaries: list[PartSummary], console: Console | None = None) -> None:
    """Print a row for each part and a total."""
    rows = [
        (
            row.part,
            row.attempts,
            f"{row.successes / max(row.attempts, 1):.1%}",
            f"{row.success_interval[0]:.0%} - {row.success_interval[1]:.0%}",
            "-" if row.median_displacement is None else f"{row.median_displacement * 1e3:.1f} mm",
            "-" if row.median_turn is None else f"{np.degrees(row.median_turn):.1f} deg",
            _counts(row.failures),
            _counts(row.discarded),
            "yes" if row.kept else "no",
        )
        for row in summaries
    ]
    attempts, successes = sum(r.attempts for r in summaries), sum(r.successes for r in summaries)
    failures = sum((Counter(row.failures) for row in summaries), Counter())
    discarded = sum((Counter(row.discarded) for row in summaries), Counter())
    total = (
        f"all {len(summaries)}", attempts, f"{successes / max(attempts, 1):.1%}", "", "", "",
        _counts(failures), _counts(discarded), f"{sum(row.kept for row in summaries)} parts",
    )  # fmt: skip
    table = Table(header=_HEADER, rows=[*rows, total], total=True)
    print_sections([Section(title="Grasps by part", text=[_EXPLAINED], tables=[table])], console)


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {n}" for name, n in sorted(counts.items(), key=lambda item: -item[1]))


def write_summary(summaries: list[PartSummary], folder: Path) -> None:
    """Write the table's numbers as ``summary.json``."""
    text = json.dumps({"schema_version": 1, "parts": [asdict(row) for row in summaries]}, indent=1)
    write_whole(folder / "summary.json", (text + "\n").encode())


def draw_summary(folder: Path, seed: int) -> Path:
    """Draw attempts of many parts, successes and failures mixed, as ``summary.png``."""
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
    draw_contact_sheet(rows, path, title=f"Grasps of {n_parts} parts, seen from above")
    return path
