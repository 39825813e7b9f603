"""Runs the whole loop over a fixed set and prints the difference to the stored run. See ``--help``."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field
from rich.console import Console
from rich.table import Table as ConsoleTable
from scipy.stats import binomtest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.metrics import bootstrap_interval, share_interval
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import WEIGHTS
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.placement_records import Placement
from mskgrasp.palletize.run import palletize
from mskgrasp.runtime.cli import run
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.options import parse
from mskgrasp.runtime.run_folder import TRIALS, file_digest, read_trials
from tests.sim_in_the_loop.record import PARTS

HERE = Path(__file__).parent
STORED = HERE / "regression.json"
SCHEMA_VERSION = 1
LEVEL = 0.99
"""Confidence level: one false alarm per figure in a hundred runs."""

DESCRIPTION = """Plans, grasps, corrects and places a fixed set of parts in the simulated cell, and prints
the differences from the run stored in the repository, with intervals over parts.

The exit status is 1 if a figure is worse than chance explains. --store replaces the stored run; use it
through make results ARGS="--record regression", which also renders the page of results."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One trial of the fixed set; metres and radians, None where the part was not held or not measured.

    Attributes:
        part: Name of the part.
        number: Index of the trial.
        held: The part was lifted.
        translation: Error of the predicted displacement.
        rotation: Error of the predicted turn.
        placed: Placement error, corrected by the prediction.
        placed_plainly: Placement error without correction.
    """

    part: str
    number: int
    held: bool
    translation: float | None
    rotation: float | None
    placed: float | None
    placed_plainly: float | None


@dataclass(frozen=True, kw_only=True)
class StoredRun:
    """A stored run: digest of the weights, and its trials."""

    weights: str
    rows: list[Row]
    schema_version: int = SCHEMA_VERSION


def read_stored(path: Path = STORED) -> StoredRun:
    """Reads the stored run.

    Raises:
        BadDataset: The file holds something else.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        found = StoredRun(**values | dict(rows=[Row(**row) for row in values["rows"]]))
    except (ValueError, TypeError, KeyError) as error:
        raise BadDataset(f"{path} is not a stored regression run; make one with --store") from error
    if found.schema_version != SCHEMA_VERSION:
        raise BadDataset(f"{path} has schema version {found.schema_version}, legal: {SCHEMA_VERSION}")
    return found


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def _median(values: np.ndarray) -> float:
    return float(np.median(values))


ERRORS = (
    ("translation", _rms, "RMSE of the displacement", 1e3, "mm"),
    ("rotation", _rms, "RMSE of the turn", 180 / math.pi, "deg"),
    ("placed", _median, "median placement error", 1e3, "mm"),
    ("placed_plainly", _median, "the same without correction", 1e3, "mm"),
)
"""Attribute of `Row`, its statistic over trials, title, scale from SI, and unit of each figure."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A figure of the trials that both runs have, and its difference; None where no trial has it."""

    title: str
    unit: str
    scale: float
    n: int
    stored: float | None = None
    now: float | None = None
    interval: tuple[float, float] | None = None
    p: float | None = None
    verdict: Literal["worse", "as before", "better", "unknown"] = "unknown"


class RegressionConfig(Config):
    """Settings of a regression run."""

    out: Path = Path("out/regression")
    """Folder of the palletizing run; a stopped run is resumed. Delete it after a change of code."""
    trials: int = Field(default=4, ge=1)
    """Trials per part; those that the stored run has, too, are compared."""
    workers: int = Field(default=1, ge=1)
    """Processes."""
    store: bool = False
    """Store this run in place of the stored one."""


def main() -> int:
    """Runs, prints, and stores where asked to."""
    config = parse(
        RegressionConfig, prog="python -m tests.sim_in_the_loop.regression", description=DESCRIPTION
    )
    rows = run_set(config)
    weights = shipped_weights()
    worse = False
    if STORED.exists():
        stored = read_stored()
        if stored.weights != weights:
            print(f"the stored run was made with other weights ({stored.weights}, now {weights})")
        if not config.store or _pairs(stored.rows, rows):
            differences = compare(stored.rows, rows)
            print_differences(differences, Console(width=110))
            worse = any(one.verdict == "worse" for one in differences)
    elif not config.store:
        raise UsageError(f"no {STORED}: make one with --store")
    if config.store:
        run = StoredRun(weights=weights, rows=rows)
        values = dict(schema_version=run.schema_version) | asdict(run)
        write_whole(STORED, (json.dumps(values, indent=1, allow_nan=False) + "\n").encode())
        print(f"stored {len(rows)} trials in {STORED.name}")
        return 0
    return int(worse)


def shipped_weights() -> str:
    """Digest of the weights that ship."""
    return file_digest(PRETRAINED / WEIGHTS)[:16]


def run_set(config: RegressionConfig) -> list[Row]:
    """Makes the trials, and a row of each."""
    settings = PalletizeConfig(
        out=config.out, parts=PARTS, trials=config.trials, corrections=("none", "predicted"),
        workers=config.workers,
    )  # fmt: skip
    palletize(settings)
    placements = read_trials(config.out / TRIALS, Placement.from_json)
    return rows_of([one for one in placements if one.number < config.trials])


def rows_of(placements: Sequence[Placement]) -> list[Row]:
    """Makes a row of each trial.

    Raises:
        BadDataset: A trial lacks a correction.
    """
    by_key = {one.key: one for one in placements}
    rows = []
    for part, number, slot, correction in sorted(by_key):
        if correction != "predicted":
            continue
        one, plain = by_key[part, number, slot, "predicted"], by_key.get((part, number, slot, "none"))
        if plain is None:
            raise BadDataset(f"trial {number} of {part} was not made without correction; delete the run")
        held = one.measured is not None and one.predicted is not None
        error = np.subtract(one.predicted, one.measured) if held else np.full(4, math.nan)
        rows.append(
            Row(
                part=part,
                number=number,
                held=held,
                translation=float(np.linalg.norm(error[:3])) if held else None,
                rotation=float(abs(wrap_angle(error[3]))) if held else None,
                placed=one.translation_error,
                placed_plainly=plain.translation_error,
            )
        )
    return rows


def _pairs(stored: Sequence[Row], now: Sequence[Row]) -> list[tuple[Row, Row]]:
    before = {(row.part, row.number): row for row in stored}
    return [(before[key], row) for row in now if (key := (row.part, row.number)) in before]


def compare(stored: Sequence[Row], now: Sequence[Row]) -> list[Difference]:
    """Compares the trials that both runs have."""
    pairs = _pairs(stored, now)
    if not pairs:
        raise UsageError("the stored run has none of these trials: store another with --store")
    return [
        _held(pairs),
        *(
            _errors(pairs, name, statistic, title=title, scale=scale, unit=unit)
            for name, statistic, title, scale, unit in ERRORS
        ),
    ]


def _held(pairs: list[tuple[Row, Row]]) -> Difference:
    lost = sum(old.held and not new.held for old, new in pairs)
    gained = sum(new.held and not old.held for old, new in pairs)
    then, today = (float(np.mean([pair[i].held for pair in pairs])) for i in (0, 1))
    # McNemar's exact test: of the trials that changed, half change either way by chance.
    p = float(binomtest(lost, lost + gained).pvalue) if lost + gained else 1.0
    verdict = "as before" if p > 1 - LEVEL else "worse" if lost > gained else "better"
    return Difference(
        title="lifted", unit="%", scale=100.0, n=len(pairs), stored=then, now=today, p=p, verdict=verdict
    )


def _errors(
    pairs: list[tuple[Row, Row]],
    name: str,
    statistic: Callable[[np.ndarray], float],
    *,
    title: str,
    scale: float,
    unit: str,
) -> Difference:
    by_part: dict[str, list[tuple[float, float]]] = {}
    for old, new in pairs:
        values = getattr(old, name), getattr(new, name)
        if None not in values:
            by_part.setdefault(old.part, []).append(values)
    groups = [np.array(one) for one in by_part.values()]
    if not groups:
        return Difference(title=title, unit=unit, scale=scale, n=0)

    def difference(rows: np.ndarray) -> float:
        return statistic(rows[:, 1]) - statistic(rows[:, 0])

    every = np.concatenate(groups)
    low, high = bootstrap_interval(groups, difference, level=LEVEL)
    return Difference(
        title=title, unit=unit, scale=scale, n=len(every), stored=statistic(every[:, 0]),
        now=statistic(every[:, 1]), interval=(low, high),
        verdict="worse" if low > 0 else "better" if high < 0 else "as before",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StoredFigure:
    """A figure of one run and its 95 % interval, in its unit.

    Attributes:
        title: Of the figure.
        unit: Of the value.
        n: Trials that have it.
        value: In the unit.
        interval: Over parts: `share_interval` of a share of trials, the bootstrap's of the others.
    """

    title: str
    unit: str
    n: int
    value: float
    interval: tuple[float, float]


def figures_of(rows: Sequence[Row]) -> list[StoredFigure]:
    """The figures of a run; those that no trial has are left out."""
    held = sum(row.held for row in rows)
    _, which = np.unique([row.part for row in rows], return_inverse=True)
    low, high = share_interval(np.bincount(which, weights=[row.held for row in rows]), np.bincount(which))
    found = [
        StoredFigure(
            title="lifted",
            unit="%",
            n=len(rows),
            value=100 * held / len(rows),
            interval=(100 * low, 100 * high),
        )
    ]
    for name, statistic, title, scale, unit in ERRORS:
        by_part: dict[str, list[float]] = {}
        for row in rows:
            if (value := getattr(row, name)) is not None:
                by_part.setdefault(row.part, []).append(scale * value)
        groups = [np.array(one) for one in by_part.values()]
        if groups:
            every = np.concatenate(groups)
            found.append(
                StoredFigure(
                    title=title,
                    unit=unit,
                    n=len(every),
                    value=statistic(every),
                    interval=bootstrap_interval(groups, statistic),
                )  # fmt: skip
            )
    return found


def stored_figures(rows: Sequence[Row]) -> Table:
    """Table of the figures of a run."""
    return Table(
        header=("figure", "trials", "value", "95 % interval"),
        rows=[
            (
                one.title,
                one.n,
                f"{one.value:.2f} {one.unit}",
                f"{one.interval[0]:.2f} - {one.interval[1]:.2f}",
            )
            for one in figures_of(rows)
        ],
    )


def print_differences(differences: Sequence[Difference], console: Console) -> None:
    """Prints a row for each figure."""
    table = ConsoleTable(title="The loop, against the stored run")
    for name in ("figure", "trials", "stored", "now", "difference", f"{LEVEL:.0%}", ""):
        table.add_column(name, justify="left" if name in ("figure", "") else "right")
    for one in differences:
        if one.stored is None or one.now is None:
            table.add_row(one.title, "0", "-", "-", "-", "-", one.verdict)
            continue
        then, today = one.stored * one.scale, one.now * one.scale
        if one.interval is None:
            spread = f"p {one.p:.2f}"
        else:
            spread = " .. ".join(f"{end * one.scale:+.2f}" for end in one.interval)
        table.add_row(
            one.title, str(one.n), f"{then:.2f} {one.unit}", f"{today:.2f} {one.unit}",
            f"{today - then:+.2f}", spread, one.verdict,
        )  # fmt: skip
    console.print(table)


if __name__ == "__main__":
    run("tests.sim_in_the_loop.regression", main)
