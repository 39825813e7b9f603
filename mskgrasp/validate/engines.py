"""The same grasps in SAPIEN and in MuJoCo."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hal.errors import DriverMissing
from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import FAILURES
from mskgrasp.core.json_text import finite
from mskgrasp.core.metrics import bootstrap_interval
from mskgrasp.parts import Part
from mskgrasp.reports.console import print_sections
from mskgrasp.reports.section import Section, Table
from mskgrasp.runtime.progress import Bar, progress
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.versions import versions
from mskgrasp.validate.compare import Comparison, compare_outcomes, distances
from mskgrasp.validate.config import SHIFTED, ValidateConfig
from mskgrasp.validate.outcomes import Outcomes, draw_grasps, run_settings

LEAST_AGREEMENT = 0.95
"""Share of random grasps in which S must agree."""
MOST_SHIFT = (0.5e-3, 3e-3)
"""Greatest difference of displacements, median and 90 %, m."""
TILTED = math.radians(2.0)
"""A part that hangs by more than this away from how it lay has tilted."""


def compare_engines(config: ValidateConfig, parts: Sequence[Part]) -> int:
    """Compare outcomes of both engines part by part; 0 if they agree within the bounds, 1 otherwise.

    Raises:
        DriverMissing: MuJoCo is not installed.
    """
    if importlib.util.find_spec("mujoco") is None:
        raise DriverMissing("--engine mujoco needs the package mujoco; run: EXTRAS=dev,mujoco .ci/setup")
    workers = process_count(config.workers)
    n = len(parts) * config.grasps_per_part
    folders = [part.folder for part in parts]
    with progress(total=n, title="drawing grasps", unit="grasp") as bar:
        drawn = draw_grasps(folders, config.grasps_per_part, config.seed, config.out, workers, _advance(bar))
    settings = config.engines()
    with progress(total=n * len(settings), title="grasps", unit="grasp", keep=True) as bar:
        found = run_settings(settings, drawn, {}, config.out, workers, _advance(bar))
    sapien, mujoco = found["sapien"], found["mujoco"]
    rows = {"all": compare_outcomes(mujoco, sapien)}
    rows |= {
        f"{name}{SHIFTED}": compare_outcomes(found[f"{name}{SHIFTED}"], found[name])
        for name in ("sapien", "mujoco")
    }
    by_part = {
        part.name: compare_outcomes(*(_of(one, part.name) for one in (mujoco, sapien))) for part in parts
    }
    differing = disagreements(mujoco, sapien)
    failed = complaints(rows["all"])
    record = {
        "settings": config.model_dump(mode="json"),
        "versions": versions() | {"mujoco": importlib.metadata.version("mujoco")},
        "engines": {name: one.to_json() for name, one in (rows | by_part).items()},
        "disagreements": [[ours, theirs, count] for (ours, theirs), count in differing],
        "lasting": lasting_disagreements(found),
        "intervals": intervals(mujoco, sapien),
        "tilted": tilted(mujoco, sapien),
        "failed": failed,
    }
    print_sections(engine_sections(record))
    path = config.out / "engines.json"
    write_whole(path, (json.dumps(finite(record), indent=1, allow_nan=False) + "\n").encode())
    print(f"wrote {path}")
    print(f"the engines differ: {'; '.join(failed)}" if failed else "the engines agree")
    return 1 if failed else 0


def engine_sections(record: dict[str, Any]) -> list[Section]:
    """Differences in words and by part, those that disagree most first, read from ``engines.json``."""
    found = [_in_words(record)]
    found += [f"Bound missed: {one}." for one in record["failed"]]
    found += [
        f"{count} grasps: {ours} in MuJoCo, {theirs} in SAPIEN"
        for ours, theirs, count in record["disagreements"]
    ]
    found.append(
        f"In {record['lasting']} of these, success differs in the same way with the starts moved by 0.1 mm, "
        "in both engines; in the others a start that near changes the outcome in one of them."
    )
    tilts = record["tilted"]
    found.append(
        f"Of {tilts['n']} grasps that hold in both engines, the part tilts by more than "
        f"{math.degrees(TILTED):g} degrees in SAPIEN alone in {tilts['sapien']}, in MuJoCo alone in "
        f"{tilts['mujoco']}, in both in {tilts['both']}."
    )
    rows = {name: Comparison.from_json(one) for name, one in record["engines"].items()}
    whole = [(name, one) for name, one in rows.items() if name == "all" or name.endswith(SHIFTED)]
    by_part = sorted((item for item in rows.items() if item not in whole), key=lambda item: item[1].agreement)
    return [Section(title="MuJoCo against SAPIEN", text=found, tables=[_table([*whole, *by_part])])]


def complaints(found: Comparison) -> list[str]:
    """Differences between two engines that exceed their bounds, in words."""
    said = []
    if found.agreement < LEAST_AGREEMENT:
        said.append(f"success agrees in {found.agreement:.1%}, at least {LEAST_AGREEMENT:.0%} is needed")
    for name, value, most in (
        ("median", found.shift_median, MOST_SHIFT[0]),
        ("90 %", found.shift_p90, MOST_SHIFT[1]),
    ):
        if not value <= most:  # NaN: nothing succeeded in both
            said.append(f"displacements differ by {1e3 * value:.2f} mm ({name}), at most {1e3 * most:g} mm")
    return said


def intervals(mujoco: Outcomes, sapien: Outcomes) -> dict[str, tuple[float, float] | None]:
    """95 % intervals of the figures of all grasps, by the bootstrap over parts.

    Returns:
        ``agreement`` (a share), ``shift_median`` and ``shift_p90`` (m); None of too few parts.
    """
    rows = np.stack([mujoco.success == sapien.success, distances(mujoco, sapien)], axis=1)
    settled = mujoco.settled & sapien.settled
    by_part = [rows[settled & (sapien.part == part)] for part in np.unique(sapien.part[settled])]
    figures: dict[str, Callable[[np.ndarray], float]] = {
        "agreement": lambda drawn: float(drawn[:, 0].mean()),
        "shift_median": lambda drawn: _percentile(drawn[:, 1], 50),
        "shift_p90": lambda drawn: _percentile(drawn[:, 1], 90),
    }
    found = {name: bootstrap_interval(by_part, figure) for name, figure in figures.items()}
    return {name: ends if np.isfinite(ends).all() else None for name, ends in found.items()}


def _percentile(values: np.ndarray, share: float) -> float:
    """Percentile of the values that are known, NaN of none."""
    known = values[~np.isnan(values)]
    return float(np.percentile(known, share)) if len(known) else np.nan


def lasting_disagreements(found: Mapping[str, Outcomes]) -> int:
    """Number of grasps whose S differs between the engines, and does so with the starts moved, too."""
    sapien, mujoco = found["sapien"], found["mujoco"]
    same = sapien.settled & mujoco.settled & (sapien.success != mujoco.success)
    for name, outcomes in (("sapien", sapien), ("mujoco", mujoco)):
        moved = found[f"{name}{SHIFTED}"]
        same &= moved.settled & (moved.success == outcomes.success)
    return int(same.sum())


def tilted(mujoco: Outcomes, sapien: Outcomes) -> dict[str, int]:
    """Number n of grasps that hold in both engines, and of those in which the part tilts, by engine."""
    held = mujoco.success & sapien.success & mujoco.settled & sapien.settled
    here, there = mujoco.tilt[held] > TILTED, sapien.tilt[held] > TILTED
    return dict(
        n=int(held.sum()),
        sapien=int((there & ~here).sum()),
        mujoco=int((here & ~there).sum()),
        both=int((here & there).sum()),
    )


def disagreements(ours: Outcomes, theirs: Outcomes) -> list[tuple[tuple[str, str], int]]:
    """Number of grasps whose S differs, by outcome in each engine; most frequent first."""
    differ = np.flatnonzero((ours.success != theirs.success) & ours.settled & theirs.settled)
    names = [(FAILURES[int(ours.failure[i])], FAILURES[int(theirs.failure[i])]) for i in differ]
    said = [(a.replace("none", "held"), b.replace("none", "held")) for a, b in names]
    return Counter(said).most_common()


def _advance(bar: Bar) -> Callable[[int], None]:
    def advance(by: int) -> None:
        bar.update(by)

    return advance


def _of(outcomes: Outcomes, part: str) -> Outcomes:
    rows = outcomes.part == part
    return outcomes.rows(rows)


def _in_words(record: dict[str, Any]) -> str:
    everything = Comparison.from_json(record["engines"]["all"])
    shifts = [
        f"{1e3 * value:.2f} mm ({name}{_ends(ends, 1e3, 2)})"
        for name, value, ends in (
            ("median", everything.shift_median, record["intervals"]["shift_median"]),
            ("90 %", everything.shift_p90, record["intervals"]["shift_p90"]),
        )
    ]
    return (
        f"Success agrees in {everything.agreement:.1%} (of {everything.n} grasps"
        f"{_ends(record['intervals']['agreement'], 100, 1)}); displacements of {everything.n_both} differ by "
        f"{' and '.join(shifts)}. Intervals: 95 %, bootstrap over parts."
    )


def _ends(ends: Sequence[float] | None, scale: float, digits: int) -> str:
    return "" if ends is None else f"; {scale * ends[0]:.{digits}f} .. {scale * ends[1]:.{digits}f}"


def _table(rows: Sequence[tuple[str, Comparison]]) -> Table:
    header = (
        "grasps", "n", "success", "same success", "shift median, mm", "90 %", "turn median, deg", "90 %",
        "CPU ms per grasp",
    )  # fmt: skip
    return Table(
        header=header,
        rows=[
            (
                name, c.n, f"{c.success_rate:.1%}", f"{c.agreement:.1%}", f"{1e3 * c.shift_median:.2f}",
                f"{1e3 * c.shift_p90:.2f}", f"{math.degrees(c.turn_median):.2f}",
                f"{math.degrees(c.turn_p90):.2f}", f"{c.cpu_ms:.0f}",
            )
            for name, c in rows
        ],
    )  # fmt: skip
