"""The paper's models beside ours, trained on the same attempts: python -m tests.benchmarks.models --help.

Trains every network with every seed, from nothing, and scores all on held-out grasps of known parts and on
novel parts. Every training is stored in --out as soon as it is finished; started again, the command goes on,
and started twice it trains two networks at a time. All stop after the same number of epochs without a lower
validation loss, and keep the epoch of the lowest. The four networks of the paper share one quality network
for each recipe.
"""

from __future__ import annotations

import argparse
import datetime
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.errors import UsageError
from mskgrasp.learning.config import DeviceName, LearningConfig
from mskgrasp.learning.label_source import source_text
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides, split
from mskgrasp.runtime import cli
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import progress
from tests.benchmarks.choice import Choice, Looks, Predictions
from tests.benchmarks.known_parts import evenly, held_out_rows, lowess_predictions
from tests.benchmarks.paper_choices import OURS, PAPER_AS_OURS, paper_choices, quick, some_rows
from tests.benchmarks.report import show
from tests.benchmarks.scores import (
    change_table,
    changes,
    coverage_table,
    errors_of,
    score_table,
    scores_of,
)
from tests.benchmarks.training_cost import add_cost_options, cost_table
from tests.benchmarks.trainings import make_trainings
from tests.docs.uses_of_test_parts import commit, log_use

LOWESS = "LOWESS"
NOTHING = "predicting zero"
POOLED_NOVEL = 35
"""Novel parts of the pooled group; the paper pools 50 known and 35 novel objects."""


@dataclass(frozen=True, kw_only=True)
class Groups:
    """Attempts to train on, and those to measure.

    Attributes:
        sides: To train on and to select epochs.
        known: Held-out attempts at training parts.
        novel: Attempts at parts of families that are not trained on.
        pooled: The known ones and as many of each of some novel parts.
    """

    sides: Sides
    known: Tensor
    novel: Tensor
    pooled: Tensor

    @classmethod
    def of(
        cls, samples: Samples, config: LearningConfig, *, novel: str, n_known: int, share: float = 1.0
    ) -> Groups:
        """Split the samples.

        Args:
            samples: The dataset.
            config: Says how parts are split.
            novel: Side of the novel parts, validation or test.
            n_known: Number of known parts.
            share: Share of the attempts to train on and to select epochs by that is used.

        Raises:
            UsageError: There is no success to measure.
        """
        sides = split(samples, config)
        known = held_out_rows(samples, sides.training, n_known)
        training = some_rows(sides.training[~torch.isin(sides.training, known)], share)
        rows = {"validation": sides.validation, "test": sides.test}[novel]
        if not len(known) or not bool(samples.success[rows].any()):
            raise UsageError(
                f"no success at {'novel' if len(known) else 'known'} parts to measure; collect more attempts"
            )
        some = evenly(torch.unique(samples.part[rows]).tolist(), POOLED_NOVEL)
        most = int(torch.bincount(samples.part[known]).max())
        pooled = torch.cat([known, *(rows[samples.part[rows] == number][:most] for number in some)])
        none = training[:0]
        validation = some_rows(sides.validation, share)
        used = Sides(training=training, validation=validation, test=none, new_sizes=none)
        return cls(sides=used, known=known, novel=rows, pooled=pooled)


def main() -> int:
    """Trains what is missing, prints the tables and writes report.json and report.md."""
    options = _options()
    if options.split == "test" and options.quick:
        raise UsageError("--quick trains too little for the test parts; leave out --split test")
    if options.at_once < 1:
        raise UsageError(f"--at-once {options.at_once}: 1 or more")
    if options.at_once > 1 and options.threads > 1:
        # A forked process hangs at its first operation in threads that its parent has started.
        raise UsageError("--threads belongs to one training at a time: leave it out with --at-once")
    torch.set_num_threads(options.threads)
    choices = paper_choices(
        options.patience, mixed_precision=options.mixed_precision, paper_seeds=options.paper_seeds,
        displacement_only=options.displacement_only,
    )  # fmt: skip
    unknown = set(options.only or ()) - {one.name for one in choices}
    if unknown:
        raise UsageError(
            f"--only {', '.join(sorted(unknown))}; legal: {', '.join(one.name for one in choices)}"
        )
    if options.only:
        chosen = [one for one in choices if one.name in options.only]
        wanted = {*options.only, *(one.quality_of for one in chosen)}
        choices = [one for one in choices if one.name in wanted]
    seeds = 1 if options.quick else options.seeds
    choices = [quick(one) for one in choices] if options.quick else choices
    looks = Looks(options.data, choices[0].config.success_range)
    # The reading that holds patches around parts serves the patches around grasps, too.
    samples = looks.of(next((c for c in choices if c.config.network.sees_object), choices[0]).config.network)
    groups = Groups.of(
        samples,
        choices[0].config,
        novel=options.split,
        n_known=options.known_parts,
        share=options.share,
    )
    options.out.mkdir(parents=True, exist_ok=True)
    without = options.out / "displacement_only"
    if options.displacement_only != without.exists() and any(options.out.glob("*/seed_*")):
        raise UsageError(
            f"{options.out} holds trainings {'without' if without.exists() else 'with'} the paper's quality "
            "network; choose another --out"
        )
    if options.displacement_only:
        without.touch()
    names = [samples.parts[number] for number in torch.unique(samples.part[groups.known]).tolist()]
    (options.out / "known_parts.txt").write_text("\n".join(names) + "\n", encoding="utf-8")
    if options.estimate:
        table = cost_table(choices, looks, groups.sides, seconds=options.measure, device=options.device)
        show([table], None)
        return 0
    tables, scores = compare(
        choices,
        looks=looks,
        groups=groups,
        novel=options.split,
        seeds=seeds,
        out=options.out,
        lowess_data=options.lowess_data,
        measure_s=0.1 if options.quick else 2.0,
        device=options.device,
        at_once=options.at_once,
    )
    trainings = {choice.name: len(choice.seeds(seeds)) for choice in choices}
    values = {"scores": scores, "seeds": trainings, "quick": options.quick, "share": options.share} | facts(
        samples, groups.sides
    )
    if options.split == "test":
        log_test_parts(len(torch.unique(samples.part[groups.novel])), scores["novel"], options.out)
        values["test_parts_logged"] = True
    show(tables, options.out, values)
    return 0


def facts(samples: Samples, sides: Sides) -> dict[str, str]:
    """Size and origin of the data that networks were trained on, for the head of a table."""
    n_parts = len(torch.unique(samples.part[sides.training]))
    n_validation = len(torch.unique(samples.part[sides.validation]))
    n_success = int(samples.success[sides.training].sum())
    return {
        "n": f"trained on {len(sides.training)} attempts at {n_parts} parts, {n_success} of them successes; "
        f"early stopping on {n_validation} parts",
        "labels": "; ".join(map(source_text, samples.sources)),
    }


def log_test_parts(n_parts: int, scores: dict[str, dict[str, Any]], out: Path) -> None:
    """Add a line to the log of the uses of test parts, with the errors of each model."""
    arguments = [one for one in sys.argv[1:] if one not in ("--out", str(out))]
    errors = (
        f"{name} {1e3 * one['translation']['mean']:.1f} mm, {np.degrees(one['rotation']['mean']):.1f} degrees"
        for name, one in scores.items()
    )
    log_use(
        datetime.date.today().isoformat(),
        commit(),
        f"python -m tests.benchmarks.models {shlex.join(arguments)}",
        f"test: {n_parts} held-out parts of the catalogue",
        "; ".join(errors),
    )


def compare(
    choices: Sequence[Choice],
    *,
    looks: Looks,
    groups: Groups,
    novel: str,
    seeds: int,
    out: Path,
    lowess_data: Path | None,
    measure_s: float = 2.0,
    device: DeviceName = "cpu",
    at_once: int = 1,
) -> tuple[list[Table], dict[str, dict[str, dict[str, Any]]]]:
    """Train what is missing, and score everything.

    Args:
        choices: Networks; their errors are compared with those of the first, and with those of the paper's
            best network by our recipe.
        looks: The samples.
        groups: Their split.
        novel: Name of the novel parts' side.
        seeds: Trainings of each network.
        out: Folder of the trainings.
        lowess_data: Dataset that LOWESS is fitted to; None: it is left out.
        measure_s: Seconds for which a network's steps are measured to predict the time left.
        device: Device of the networks.
        at_once: Trainings at a time.

    Returns:
        Tables, and `Scores` by group and model as plain values.
    """
    measured = {"known": groups.known, novel: groups.novel}
    trained = make_trainings(
        choices,
        seeds=seeds,
        looks=looks,
        sides=groups.sides,
        groups=measured,
        out=out,
        measure_s=measure_s,
        device=device,
        at_once=at_once,
    )
    samples = looks.of(choices[0].config.network)
    kept, success = torch.isin(groups.novel, groups.pooled), samples.success[groups.novel].numpy()
    rows = {
        "known": groups.known,
        "novel": groups.novel,
        "pooled": torch.cat([groups.known, groups.novel[kept]]),
    }
    each: dict[str, dict[str, list[Predictions]]] = {name: {} for name in rows}
    if lowess_data is not None:
        lowess = lowess_predictions(samples, groups.known, groups.sides.training, lowess_data)
        each["known"][LOWESS] = [lowess]
    for name, found in trained.items():
        each["known"][name] = [one["known"] for one in found]
        each["novel"][name] = [one[novel] for one in found]
        each["pooled"][name] = [one["known"] + one[novel].only(kept.numpy(), success) for one in found]
    base_rate = float(samples.success[groups.sides.training].double().mean())
    tables, scores = [], {}
    for group, title in (
        ("known", "Known parts, held-out grasps"), ("novel", f"Novel parts ({novel})"),
        ("pooled", "Known and novel parts pooled, as in the paper"),
    ):  # fmt: skip
        nothing = np.zeros((int(samples.success[rows[group]].sum()), 4))
        each[group][NOTHING] = [Predictions(quality=np.zeros(0), mean=nothing, variance=nothing * np.nan)]
        of_group = {
            name: scores_of(samples, rows[group], each[group][name], base_rate)
            for name in progress(list(each[group]), unit="model", title=f"score {group} parts")
        }
        scores[group] = {name: one.to_json() for name, one in of_group.items()}
        n_parts = len(samples.part[rows[group]].unique())
        caption = f"{title}: {len(rows[group])} grasps of {n_parts} parts"
        tables += [score_table(of_group, bold=OURS, caption=caption), coverage_table(of_group)]
    for reference in dict.fromkeys((choices[0].name, PAPER_AS_OURS)):
        rivals = [choice.name for choice in choices if choice.name != reference]
        if reference in trained and rivals:
            theirs = errors_of(samples, groups.novel, each["novel"][reference])
            relative = {
                name: changes(errors_of(samples, groups.novel, each["novel"][name]), theirs)
                for name in rivals
            }
            caption = f"Change of the error on novel parts relative to {reference}"
            tables.append(change_table(relative, caption))
    return tables, scores


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.models",
        description="Train the paper's models and ours on the same attempts, and compare them.",
    )
    parser.add_argument("--data", type=Path, required=True, help="dataset folder")
    parser.add_argument("--out", type=Path, required=True, help="folder of trainings, report.json, report.md")
    parser.add_argument("--seeds", type=int, default=3, help="trainings of each network (default 3)")
    parser.add_argument(
        "--paper-seeds",
        type=int,
        help="the most by the paper's recipe, the slowest (default: --seeds)",
    )
    parser.add_argument(
        "--split", choices=("validation", "test"), default="validation",
        help="novel parts; test for final tables only, which is logged (default validation)",
    )  # fmt: skip
    parser.add_argument("--only", nargs="+", metavar="NAME", help="networks, beside those that they need")
    parser.add_argument("--patience", type=int, default=10, help="epochs without improvement (default 10)")
    parser.add_argument(
        "--share", type=float, default=1.0, help="of the attempts to train on and to stop by (default 1)"
    )
    parser.add_argument(
        "--mixed-precision", action="store_true",
        help="the paper's networks train in bfloat16: faster on a GPU, or a CPU with instructions for it",
    )  # fmt: skip
    parser.add_argument(
        "--displacement-only", action="store_true",
        help="no quality network by the paper's recipe, the slowest of all: enough to compare displacements",
    )  # fmt: skip
    parser.add_argument("--known-parts", type=int, default=50, help="known parts to measure (default 50)")
    parser.add_argument(
        "--lowess-data", type=Path,
        help="dataset of 1000 attempts at each of the parts in known_parts.txt; without it no LOWESS",
    )  # fmt: skip
    parser.add_argument(
        "--device", choices=get_args(DeviceName), default="cpu",
        help="auto: a GPU where there is one (default cpu)",
    )  # fmt: skip
    parser.add_argument("--at-once", type=int, default=1, help="trainings at a time (default 1)")
    add_cost_options(parser)
    return parser.parse_args()


if __name__ == "__main__":
    cli.run("models", main)
