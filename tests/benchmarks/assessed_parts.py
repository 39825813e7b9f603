"""Assessments of many parts, tried again in fresh scenes. Run: python -m tests.benchmarks.assessed_parts -h.

Assesses parts as ``python -m mskgrasp.assess`` does, then grasps and places each by its certified grasps in
scenes of another seed, as a customer would. Prints the trials of all parts together, by what planned them and
by condition, and whether the shares placed that each report states hold in the fresh scenes.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mskgrasp.assess.config import AssessConfig, parse_tolerance
from mskgrasp.assess.run import assess, begin_trials
from mskgrasp.assess.summary import DISTANCES, Row, summarise
from mskgrasp.assess.trials import CONDITIONS, EXACT, PLANNERS, AssessSetup, trial_bench, write_cells
from mskgrasp.core.errors import BadPart
from mskgrasp.core.grasp import MAX_OPENING, TILT_LIMIT
from mskgrasp.core.metrics import rms_interval, share_interval
from mskgrasp.core.panda_body import HAND_MASS, PAYLOAD
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.evaluate.summary import displacement_errors
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.parts import Part, find_part
from mskgrasp.parts.hulls import hull_corners
from mskgrasp.parts.importing.mesh_files import LOADERS
from mskgrasp.parts.least_width import least_widths
from mskgrasp.parts.select_parts import part_names
from mskgrasp.planning.certified import read_certified
from mskgrasp.planning.for_cell import part_name
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import note
from mskgrasp.runtime.run_folder import TRIALS, read_trials
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.simulation.certify import CertifyConfig
from mskgrasp.trials.placed_scenes import SceneTask, placed_trials
from mskgrasp.trials.placed_trial import PlacedTrial
from tests.benchmarks.report import show

FRESH_SEED = 1
SIZES = (0.02, 0.15)
"""Longest edges of the catalogue's parts, metres."""
FRESH = "exact camera, fresh scenes"
Trials = Mapping[str, Sequence[PlacedTrial]]
"""Trials by part."""


def main() -> int:
    """Prints the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.assessed_parts",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--parts", nargs="+", default=["test:20"],
        help="names of parts, folders of CAD files, or sets such as test:20 (default)",
    )  # fmt: skip
    parser.add_argument(
        "--n-parts", type=int, default=0, help="so many of them: of a set evenly spaced, of a folder by hash"
    )
    parser.add_argument("--fresh", type=int, default=100, help="fresh trials of each part (default 100)")
    parser.add_argument("--quick", action="store_true", help="as in mskgrasp.assess")
    parser.add_argument("--tolerance", default="1mm,2deg", help="as in mskgrasp.assess (default 1mm,2deg)")
    parser.add_argument(
        "--out", type=Path, default=Path("out/assessed"), help="folder (default out/assessed)"
    )
    options = parser.parse_args()
    parts = chosen_parts(options.parts, options.n_parts)
    workers = process_count()
    config = AssessConfig(
        parts=tuple(str(part.folder) for part in parts), quick=options.quick, tolerance=options.tolerance,
        out=options.out / "reports",
    )  # fmt: skip
    assess(config)
    alone = len(parts) == 1
    reported, fresh = {}, {}
    for part in parts:
        note(f"fresh scenes of {part.name}")
        out = config.out if alone else config.out / part.name
        reported[part.name] = read_trials(out / TRIALS, PlacedTrial.from_json)
        fresh[part.name] = fresh_trials(part, options.out / "fresh" / part.name, options.fresh, workers)
    tables = [pooled(reported, fresh), agreement(reported, fresh, options.tolerance)]
    tables.append(by_part(reported, fresh, options.tolerance))
    n_reported, n_fresh = (sum(map(len, trials.values())) for trials in (reported, fresh))
    n = f"{n_reported} trials of the reports and {n_fresh} fresh ones; {len(parts)} parts"
    show(tables, options.out, dict(n=n))
    return 0


def chosen_parts(words: Sequence[str], n: int) -> list[Part]:
    """Parts of names, of sets of the shipped model, and of CAD files in folders.

    Of a folder those files count that become parts of catalogue size which a hand can hold from above as they
    lie; the first n in the order of the digests of their names.
    """
    found: list[Part] = []
    for word in words:
        folder = Path(word)
        if not folder.is_dir() or (folder / "part.json").exists():
            names = part_names((word,), load_models(PRETRAINED).meta.training, n)
            found += [find_part(name) for name in names]
            continue
        files = [file for file in folder.iterdir() if file.suffix.lower() in LOADERS]
        kept: list[Part] = []
        for file in sorted(files, key=lambda one: hashlib.sha256(one.name.encode()).hexdigest()):
            try:
                part = find_part(part_name(str(file)))
            except BadPart as error:
                note(f"left out: {error}")
                continue
            if why := _unfit(part):
                note(f"left out: {file.name}: {why}")
                continue
            kept.append(part)
            if len(kept) == n:
                break
        found += kept
    return found


def _unfit(part: Part) -> str:
    """Reason why certified grasps of a part say nothing; empty where there is none."""
    edge = float(np.ptp(np.concatenate(hull_corners(part)), axis=0).max())
    if not SIZES[0] <= edge <= SIZES[1]:
        return f"its longest edge is {1e3 * edge:.0f} mm"
    if part.mass > PAYLOAD - HAND_MASS:
        return f"it weighs {part.mass:.2f} kg"
    often = part.resting_probability >= CertifyConfig().least_probability
    return "wider than the hand as it lies" if least_widths(part)[often].max() > MAX_OPENING else ""


def fresh_trials(part: Part, out: Path, n: int, workers: int) -> list[PlacedTrial]:
    """Trials by certified grasps with an exact camera, in scenes that no report has seen; resumes."""
    cli.make_folder(out)
    certified = read_certified(part)
    begin_trials(out, certified)
    setup = AssessSetup(
        source=str(part.folder), certified=certified, models=PRETRAINED, cells=write_cells(out), out=out,
        seed=FRESH_SEED, spread=False,
    )  # fmt: skip
    tasks = [
        SceneTask(
            source=setup.source, part=part.name, condition=EXACT, number=number, planners=("certified",)
        )
        for number in range(n)
    ]
    return placed_trials(trial_bench, setup, tasks, out, workers)


def pooled(reported: Trials, fresh: Trials) -> Table:
    """Trials of all parts together; shares are of all attempts, intervals by parts."""
    rows = []
    for condition in CONDITIONS:
        for planner in PLANNERS:
            chosen = {
                part: [trial for trial in trials if (trial.condition, trial.planner) == (condition, planner)]
                for part, trials in reported.items()
            }
            if any(chosen.values()):
                rows.append((condition, planner, *_figures(chosen)))
    rows.append((FRESH, "certified", *_figures(fresh)))
    header = (
        "condition", "planned by", "trials", "lifted", "RMSE, mm", "RMSE, deg", "predicted within 1 mm",
        "placed within 1 mm", "placed within 2 mm", "tilted",
    )  # fmt: skip
    return Table(header=header, rows=rows, caption="All parts")


def _figures(trials: Trials) -> tuple[str, ...]:
    groups = [list(one) for one in trials.values() if one]

    def share(hits: Sequence[Sequence[bool]]) -> str:
        n, of = np.array([sum(one) for one in hits]), np.array([len(one) for one in hits])
        low, high = share_interval(n[of > 0], of[of > 0])
        return f"{n.sum() / max(1, of.sum()):.1%} [{low:.1%}, {high:.1%}]"

    errors = [_errors(one) for one in groups]
    compared = [one for one in errors if len(one[0])]

    def rmse(which: int, scale: float) -> str:
        values = [one[which] for one in compared]
        total = np.sqrt((np.concatenate(values) ** 2).mean()) if values else np.nan
        interval = rms_interval(values)
        ends = f" [{scale * interval[0]:.2f}, {scale * interval[1]:.2f}]" if interval else ""
        return f"{scale * total:.2f}{ends}"

    def placed(most: float) -> list[list[bool]]:
        return [
            [(error := one.error("predicted")) is not None and error[0] <= most for one in group]
            for group in groups
        ]

    near = [
        [*(one[0] <= 1e-3).tolist(), *[False] * (len(group) - len(one[0]))]
        for one, group in zip(errors, groups, strict=True)
    ]
    return (
        str(sum(map(len, groups))),
        share([[one.lifted for one in group] for group in groups]),
        rmse(0, 1e3),
        rmse(1, 180 / np.pi),
        share(near),
        share(placed(1e-3)),
        share(placed(2e-3)),
        share([[(one.tilt or 0.0) > TILT_LIMIT for one in group if one.lifted] for group in groups]),
    )


def _errors(trials: Sequence[PlacedTrial]) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the predicted displacements of lifted parts, metres and radians."""
    pairs = [
        (one.predicted, one.measured) for one in trials
        if one.lifted and one.predicted is not None and one.measured is not None
    ]  # fmt: skip
    predicted, measured = (np.array([pair[k] for pair in pairs]).reshape(-1, 4) for k in (0, 1))
    return displacement_errors(predicted, measured)


def _row(trials: Sequence[PlacedTrial], tolerance: str) -> Row:
    chosen = [one for one in trials if (one.condition, one.planner) == (EXACT, "certified")]
    return summarise(chosen, parse_tolerance(tolerance), TILT_LIMIT)[0]


def agreement(reported: Trials, fresh: Trials, tolerance: str) -> Table:
    """How many parts place as large a share within a distance in fresh scenes as their report says."""
    pairs = [(_row(reported[part], tolerance), _row(fresh[part], tolerance)) for part in reported]
    rows = []
    for i, distance in enumerate(DISTANCES):
        shares = [(a.within_distance["predicted"][i], b.within_distance["predicted"][i]) for a, b in pairs]
        agree = sum(a.interval[0] <= b.value <= a.interval[1] for a, b in shares)
        rows.append((
            f"{1e3 * distance:g} mm", f"{np.mean([a.value for a, _ in shares]):.1%}",
            f"{np.mean([b.value for _, b in shares]):.1%}", f"{agree} of {len(shares)}",
        ))  # fmt: skip
    header = ("placed within", "reports, mean", "fresh, mean", "parts whose fresh share is in the interval")
    return Table(header=header, rows=rows, caption="Reports and fresh scenes")


def by_part(reported: Trials, fresh: Trials, tolerance: str) -> Table:
    """A row a part, of its certified grasps with an exact camera."""
    rows = []
    for part in reported:
        report, again = _row(reported[part], tolerance), _row(fresh[part], tolerance)
        told, found = report.within["predicted"], again.within["predicted"]
        low, high = told.interval
        errors = _errors(fresh[part])[0]
        rows.append((
            part, f"{again.certified.value:.0%}", f"{again.lifted.value:.0%}",
            f"{1e3 * np.sqrt((errors**2).mean()):.2f}" if len(errors) else "-",
            f"{told.value:.0%} [{low:.0%}, {high:.0%}]", f"{found.value:.0%}",
            "yes" if low <= found.value <= high else "no",
        ))  # fmt: skip
    header = (
        "part", "planned by certified grasps", "lifted", "RMSE, mm", f"report: placed within {tolerance}",
        "fresh", "agrees",
    )  # fmt: skip
    return Table(header=header, rows=rows, caption="Certified grasps, exact camera, by part")


if __name__ == "__main__":
    cli.run("assessed_parts", main)
