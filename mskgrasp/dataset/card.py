"""Card of a dataset: contents, provenance and size, as tables for a terminal and as Markdown."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.metrics import share_interval
from mskgrasp.dataset.label_error import read_label_error
from mskgrasp.dataset.shards import list_shards, read_columns

CardTable = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""Title, headers, rows."""


@dataclass(frozen=True, kw_only=True)
class Family:
    """Attempts at the parts of one family.

    Attributes:
        tried: Number of attempts at each part.
        won: Number of those that lifted it.
    """

    tried: tuple[int, ...]
    won: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Card:
    """Statistics of a dataset.

    Attributes:
        name: Name of its folder.
        shards: Number of files.
        parts: Number of different parts.
        families: By name, sorted.
        failures: Attempts that failed, by reason.
        discarded: Discarded attempts, by reason; not among the attempts.
        redrawn: Number of scenes drawn again because the part was not at rest.
        displacement: Median and 90th percentile of the translation over successes, metres; None without.
        turn: The same of |dtheta|, radians.
        image: Height and width of a depth image, pixels.
        seed: Seed of all random numbers.
        planner: Digest of the model whose planner chose the grasps; empty: they are random.
        physics: Settings of the simulation.
        noise: Simulated errors of the cell; empty: none.
        versions: Sets of software versions, and how many shards were made with each.
        size: Bytes on disk.
    """

    name: str
    shards: int
    parts: int
    families: dict[str, Family]
    failures: dict[str, int]
    discarded: dict[str, int]
    redrawn: int
    displacement: tuple[float, float] | None
    turn: tuple[float, float] | None
    image: tuple[int, int]
    seed: int
    planner: str
    physics: dict[str, Any]
    noise: dict[str, Any]
    versions: list[tuple[dict[str, str], int]]
    size: int

    @property
    def attempts(self) -> int:
        """Number of attempts."""
        return sum(sum(family.tried) for family in self.families.values())

    @property
    def successes(self) -> int:
        """Number of attempts that lifted the part."""
        return sum(sum(family.won) for family in self.families.values())


def read_card(folder: Path, watch: Callable[[Sequence[Path]], Iterable[Path]] = iter) -> Card:
    """Summarise a dataset without reading its images.

    Args:
        folder: Folder of the dataset.
        watch: Yields each of the files that will be read; may show a progress bar.

    Raises:
        BadDataset: There is no shard, or one is damaged.
    """
    tried: dict[str, Counter[str]] = defaultdict(Counter)
    won: dict[str, Counter[str]] = defaultdict(Counter)
    failures: Counter[int] = Counter()
    discarded: Counter[str] = Counter()
    versions: Counter[tuple[tuple[str, str], ...]] = Counter()
    moved: list[np.ndarray] = []
    paths = list_shards(folder)
    size, redrawn, info, image = 0, 0, None, (0, 0)
    for path in watch(paths):
        columns, info = read_columns(path, ("success", "failure", "displacement"))
        codes = columns["failure"]
        if len(codes) and not 0 <= codes.min() <= codes.max() < len(FAILURES):
            raise BadDataset(f"{path}: failure counts what has no name; delete it and collect again")
        tried[info.family][info.part] += len(columns["success"])
        won[info.family][info.part] += int(columns["success"].sum())
        failures.update(columns["failure"][~columns["success"]].tolist())
        discarded.update(info.discarded)
        redrawn += info.redrawn
        versions[tuple(sorted(info.versions.items()))] += 1
        moved.append(columns["displacement"][columns["success"]])
        size += path.stat().st_size
    assert info is not None  # list_shards returns one at least
    image = image_size(paths[0])
    held = np.concatenate(moved)
    return Card(
        name=folder.resolve().name,
        shards=len(paths),
        parts=len({name for parts in tried.values() for name in parts}),
        families={
            family: Family(tried=tuple(parts.values()), won=tuple(won[family][name] for name in parts))
            for family, parts in sorted(tried.items())
        },
        failures={FAILURES[code]: n for code, n in failures.most_common()},
        discarded=dict(discarded.most_common()),
        redrawn=redrawn,
        displacement=_median_and_tail(np.linalg.norm(held[:, :3], axis=1)),
        turn=_median_and_tail(np.abs(held[:, 3])),
        image=image,
        seed=info.seed,
        planner=info.planner,
        physics=dict(info.physics),
        noise=dict(info.noise),
        versions=[(dict(names), n) for names, n in versions.most_common()],
        size=size,
    )


def image_size(path: Path) -> tuple[int, int]:
    """Read height and width of a shard's depth images, pixels.

    Raises:
        BadDataset: The shard is damaged.
    """
    depth = read_columns(path, ("depth",))[0]["depth"]
    return depth.shape[1], depth.shape[2]


def _median_and_tail(values: np.ndarray) -> tuple[float, float] | None:
    if not len(values):
        return None
    median, tail = np.quantile(values, (0.5, 0.9))
    return float(median), float(tail)


def tables(card: Card) -> list[CardTable]:
    """Title, headers and rows of each table of the card."""
    n, families = card.attempts, card.families.values()
    facts = [
        ("attempts", f"{n}"),
        ("grasps", f"chosen by the planner of model {card.planner}" if card.planner else "random"),
        ("parts", f"{card.parts} of {len(card.families)} families"),
        ("success", _share([k for f in families for k in f.won], [k for f in families for k in f.tried])),
    ]
    if card.displacement and card.turn:
        moved, turned = np.array(card.displacement) * 1e3, np.degrees(card.turn)
        facts += [
            ("displacement", f"median {moved[0]:.2f} mm, 90 % under {moved[1]:.1f} mm"),
            ("turn", f"median {turned[0]:.2f} degrees, 90 % under {turned[1]:.1f} degrees"),
        ]
    simulations = {names.get("simulation", "unknown") for names, _ in card.versions}
    facts += [
        ("error of a label", read_label_error(simulations, card.physics)),
        ("depth images", f"{card.image[1]} x {card.image[0]} pixels, uint16, 0.1 mm"),
        ("seed", f"{card.seed}"),
        ("scenes drawn again", f"{card.redrawn}, as the part was not at rest"),
        ("on disk", f"{card.shards} shards, {_bytes(card.size)}, {_bytes(card.size / max(n, 1))} an attempt"),
    ]
    by_family = [
        (name, f"{len(f.tried)}", f"{sum(f.tried)}", _share(f.won, f.tried))
        for name, f in card.families.items()
    ]
    failures = [(name, f"{count}", f"{count / max(n, 1):.1%}") for name, count in card.failures.items()]
    discarded = [(name, f"{count}") for name, count in card.discarded.items()] or [("none", "0")]
    versions = [
        (", ".join(f"{name} {version}" for name, version in names.items()), f"{count}")
        for names, count in card.versions
    ]
    return [
        (f"Dataset {card.name}", ("", ""), facts),
        ("Success by family", ("family", "parts", "attempts", "success (95 % interval)"), by_family),
        ("Failures", ("reason", "attempts", "share"), failures or [("none", "0", "0.0%")]),
        ("Discarded", ("reason", "attempts"), discarded),
        ("Physics", ("setting", "value"), [(key, f"{value}") for key, value in card.physics.items()]),
        (
            "Errors of the cell",
            ("setting", "value"),
            [(key, f"{value}") for key, value in card.noise.items() if value] or [("none", "")],
        ),
        ("Software", ("versions", "shards"), versions),
    ]


def report(card: Card) -> dict[str, Any]:
    """Make the card's content as JSON: number of attempts, physics of the labels, tables."""
    simulations = ", ".join(sorted({names.get("simulation", "unknown") for names, _ in card.versions}))
    rate, iterations = (card.physics.get(name, "unknown") for name in ("rate_hz", "position_iterations"))
    return {
        "n": f"{card.attempts} attempts at {card.parts} parts, seed {card.seed}",
        "labels": f"{rate} Hz, {iterations} iterations; simulation version {simulations}",
        "tables": [{"title": title, "header": header, "rows": rows} for title, header, rows in tables(card)],
    }


def markdown(card: Card) -> str:
    """Format the card as Markdown."""
    blocks = []
    for level, (title, headers, rows) in enumerate(tables(card)):
        # A pipe in a name would end its cell.
        cells = [[cell.replace("|", "\\|") for cell in row] for row in (headers, *rows)]
        lines = ["| " + " | ".join(row) + " |" for row in cells]
        lines.insert(1, "|" + "---|" * len(headers))
        blocks.append(f"{'##' if level else '#'} {title}\n\n" + "\n".join(lines) + "\n")
    return "\n".join(blocks)


def _share(won: Sequence[int], tried: Sequence[int]) -> str:
    """Share of successes by their numbers at each part, at which attempts are alike."""
    low, high = share_interval(np.array(won), np.array(tried))
    return f"{sum(won) / max(sum(tried), 1):.1%} ({low:.1%} - {high:.1%})"


def _bytes(n: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if n < 1000:
            return f"{n:.0f} {unit}" if unit == "B" else f"{n:.1f} {unit}"
        n /= 1000
    return f"{n:.2f} TB"
