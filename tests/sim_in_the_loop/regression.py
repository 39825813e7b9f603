"""Runs the whole loop over a fixed set and prints the difference to the stored run. See ``--help``."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.metrics import bootstrap_interval
from mskgrasp.learning.grasp_models import PRETRAINED
from mskgrasp.palletize.config import PalletizeConfig
from mskgrasp.palletize.placements import Placement
from mskgrasp.palletize.run import palletize
from mskgrasp.runtime.cli import run
from mskgrasp.runtime.options import parse
from mskgrasp.runtime.run_folder import TRIALS, file_digest, read_trials
from tests.sim_in_the_loop.record import PARTS

HERE = Path(__file__).parent
STORED = HERE / "regression.json"
LEVEL = 0.99
"""Of confidence: one false alarm in a hundred runs and figure."""

Row = dict[str, Any]

DESCRIPTION = """Plans, grasps, corrects and places a fixed set of parts in the simulated cell, and prints
what has changed against the run stored in the repository, with intervals over parts.

Ends with 1 if anything is worse than chance explains. --store keeps this run as the stored one: commit it
with the change that explains it."""


class RegressionConfig(Config):
    """Settings of a regression run."""

    out: Path = Path("out/regression")
    """Folder of the palletizing run; a stopped one goes on. Delete it after a change of code."""
    trials: int = Field(default=4, ge=1)
    """Trials a part; compared are those that the stored run has, too."""
    workers: int = Field(default=1, ge=1)
    """Processes."""
    store: bool = False
    """Keep this run as the stored one."""


def main() -> int:
    """Runs, prints, and stores where told to."""
    config = parse(
        RegressionConfig, prog="python -m tests.sim_in_the_loop.regression", description=DESCRIPTION
    )
    rows = run_set(config)
    weights = file_digest(PRETRAINED / "model.safetensors")[:16]
    worse = False
    if STORED.exists():
        stored = json.loads(STORED.read_text(encoding="utf-8"))
        if stored["weights"] != weights:
            print(f"the stored run was made with other weights ({stored['weights']}, now {weights})")
        if not config.store or _pairs(stored["rows"], rows):
            figures = compare(stored["rows"], rows)
            print_figures(figures, Console(width=110))
            worse = any(figure["verdict"] == "worse" for figure in figures)
    elif not config.store:
        raise UsageError(f"no {STORED}: make one with --store")
    if config.store:
        values = dict(schema_version=1, weights=weights, rows=rows)
        write_whole(STORED, (json.dumps(values, indent=1, allow_nan=False) + "\n").encode())
        print(f"stored {len(rows)} trials in {STORED.name}")
        return 0
    return int(worse)


def run_set(config: RegressionConfig) -> list[Row]:
    """Makes the trials, and what is compared of each."""
    settings = PalletizeConfig(
        out=config.out, parts=PARTS, trials=config.trials, corrections=("none", "predicted"),
        workers=config.workers,
    )  # fmt: skip
    palletize(settings)
    placements = read_trials(config.out / TRIALS, Placement.from_json)
    return rows_of([one for one in placements if one.number < config.trials])


def rows_of(placements: Sequence[Placement]) -> list[Row]:
    """A row for each trial: whether the part was held, how far the prediction was off, where it was put.

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
            dict(
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
    before = {(row["part"], row["number"]): row for row in stored}
    return [(before[key], row) for row in now if (key := (row["part"], row["number"])) in before]


def compare(stored: Sequence[Row], now: Sequence[Row]) -> list[dict[str, Any]]:
    """Figures of trials that both runs have, their difference and what to make of it."""
    pairs = _pairs(stored, now)
    if not pairs:
        raise UsageError("the stored run has none of these trials: store another with --store")
    found = [_held(pairs)]
    for name, title, scale, unit, statistic in (
        ("translation", "RMSE of the displacement", 1e3, "mm", _rms),
        ("rotation", "RMSE of the turn", 180 / math.pi, "deg", _rms),
        ("placed", "median placement error", 1e3, "mm", _median),
        ("placed_plainly", "the same without correction", 1e3, "mm", _median),
    ):
        found.append(_errors(pairs, name, statistic) | dict(title=title, scale=scale, unit=unit))
    return found


def _held(pairs: list[tuple[Row, Row]]) -> dict[str, Any]:
    lost = sum(old["held"] and not new["held"] for old, new in pairs)
    gained = sum(new["held"] and not old["held"] for old, new in pairs)
    then, today = (np.mean([pair[i]["held"] for pair in pairs]) for i in (0, 1))
    # McNemar's exact test: of the trials that changed, half change either way by chance.
    p = binomtest(lost, lost + gained).pvalue if lost + gained else 1.0
    verdict = "as before" if p > 1 - LEVEL else "worse" if lost > gained else "better"
    return dict(
        title="held", n=len(pairs), stored=float(then), now=float(today), interval=None, p=float(p),
        verdict=verdict, scale=100.0, unit="%",
    )  # fmt: skip


def _errors(
    pairs: list[tuple[Row, Row]], name: str, statistic: Callable[[np.ndarray], float]
) -> dict[str, Any]:
    by_part: dict[str, list[tuple[float, float]]] = {}
    for old, new in pairs:
        if old[name] is not None and new[name] is not None:
            by_part.setdefault(old["part"], []).append((old[name], new[name]))
    values = [np.array(one) for one in by_part.values()]
    if not values:
        return dict(n=0, stored=None, now=None, interval=None, p=None, verdict="unknown")

    def difference(rows: np.ndarray) -> float:
        return statistic(rows[:, 1]) - statistic(rows[:, 0])

    every = np.concatenate(values)
    low, high = bootstrap_interval(values, difference, level=LEVEL)
    verdict = "worse" if low > 0 else "better" if high < 0 else "as before"
    return dict(
        n=len(every), stored=statistic(every[:, 0]), now=statistic(every[:, 1]), interval=[low, high], p=None,
        verdict=verdict,
    )  # fmt: skip


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def _median(values: np.ndarray) -> float:
    return float(np.median(values))


def print_figures(figures: Sequence[dict[str, Any]], console: Console) -> None:
    """A row a figure."""
    table = Table(title="The loop, against the stored run")
    for name in ("figure", "trials", "stored", "now", "difference", f"{LEVEL:.0%}", ""):
        table.add_column(name, justify="left" if name in ("figure", "") else "right")
    for figure in figures:
        scale, unit = figure["scale"], figure["unit"]
        if figure["stored"] is None:
            table.add_row(figure["title"], "0", "-", "-", "-", "-", figure["verdict"])
            continue
        then, today, interval = figure["stored"] * scale, figure["now"] * scale, figure["interval"]
        if interval is None:
            spread = f"p {figure['p']:.2f}"
        else:
            spread = " .. ".join(f"{end * scale:+.2f}" for end in interval)
        table.add_row(
            figure["title"], str(figure["n"]), f"{then:.2f} {unit}", f"{today:.2f} {unit}",
            f"{today - then:+.2f}", spread, figure["verdict"],
        )  # fmt: skip
    console.print(table)


if __name__ == "__main__":
    run("tests.sim_in_the_loop.regression", main)
