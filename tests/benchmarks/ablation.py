"""Ablations of our network. Run: python -m tests.benchmarks.ablation --help.

Every line trains both networks anew on the same attempts, with one choice of configs/train/pretrained.yaml
undone, and scores them on the validation parts, which training never saw; test parts are not looked at.
Every training is stored in --out as soon as it is finished; started again, the command goes on.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from mskgrasp.core.config import read_config
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides, split
from mskgrasp.runtime import cli
from mskgrasp.runtime.progress import progress
from tests.benchmarks.choice import Choice, Looks
from tests.benchmarks.models import facts
from tests.benchmarks.paper_choices import CONFIGS, OURS, some_rows
from tests.benchmarks.report import show
from tests.benchmarks.score_details import detail_table, details_of
from tests.benchmarks.scores import change_table, changes, coverage_table, errors_of, score_table, scores_of
from tests.benchmarks.trainings import make_trainings


def variants(ours: LearningConfig) -> dict[str, LearningConfig]:
    """Our configuration, and the same with one choice undone or made."""
    paper = read_config(LearningConfig, CONFIGS / "paper.yaml").network

    def with_(**changes: Any) -> LearningConfig:
        network = changes.pop("network", {})
        return ours.model_copy(update=changes | {"network": ours.network.model_copy(update=network)})

    plain = {"displacement_layers": (16, 32, 32), "displacement_blocks": ()}
    assert isinstance(paper, PatchNetworkConfig)
    paper = paper.model_copy(update={"symmetric_views": ours.network.symmetric_views})
    return {
        OURS: ours,
        "the paper's network, trained as ours": ours.model_copy(update={"network": paper}),
        "quality sees all pixels": with_(network={"quality_stride": 1, "layers": (8, 32, 32)}),
        "displacement sees as far across as along": with_(
            network={"patch_columns": None, "quality_columns": 17}
        ),
        "displacement sees every second pixel": with_(
            network={
                "patch_pixels": 33,
                "patch_columns": 17,
                "patch_side": 0.132,
                "quality_stride": 1,
                "displacement_layers": (16, 32),
                "displacement_blocks": (0, 1),
            }
        ),
        "quality with twice the channels at first": with_(network={"layers": (16, 32)}),
        "half the channels": with_(network={"layers": (4, 16), "displacement_layers": (8, 16, 32)}),
        "twice the channels": with_(network={"layers": (16, 64), "displacement_layers": (32, 64, 128)}),
        "no residual blocks": with_(network=plain),
        "residual blocks after every layer": with_(network={"displacement_blocks": (1, 1, 1)}),
        "no swing": with_(network={"swing": False}),
        "one Gaussian": with_(network={"mixture": 1}),
        "one Gaussian, beta 0.5": with_(beta=0.5, network={"mixture": 1}),
        "one Gaussian, beta 0.5, no residual blocks, no swing": with_(
            beta=0.5, network=plain | {"mixture": 1, "swing": False}
        ),
        "no half turns and mirror images": with_(symmetric=False, network={"symmetric_views": False}),
        "one view of each grasp": with_(network={"symmetric_views": False}),
        "no noise": with_(noise_std=0.0),
        "no floor of the deviations": with_(network={"least_std": (0.0, 0.0)}),
        "no dropout": with_(network={"dropout": 0.0}),
        "dropout 0.2": with_(network={"dropout": 0.2}),
        "no batch normalisation": with_(gdn=ours.gdn.model_copy(update={"batch_norm": False})),
        "no weight decay": with_(gdn=ours.gdn.model_copy(update={"weight_decay": 0.0})),
        "neither": with_(gdn=ours.gdn.model_copy(update={"batch_norm": False, "weight_decay": 0.0})),
        "not calibrated": with_(calibrate=False),
        "mixed precision": with_(mixed_precision=True),
    }


def main() -> int:
    """Trains what is missing, prints the tables and writes report.json and report.md."""
    options = _options()
    torch.set_num_threads(options.threads)
    ours = read_config(LearningConfig, CONFIGS / "pretrained.yaml")
    epochs = {"gqn": options.gqn_epochs, "gdn": options.gdn_epochs}
    ours = ours.model_copy(
        update={name: getattr(ours, name).model_copy(update={"epochs": n}) for name, n in epochs.items()}
    )
    share = partial(_some, share=options.share)
    choices = [
        Choice(name=name, config=config, sides=share)
        for name, config in variants(ours).items()
        if name == OURS or not options.only or name.startswith(tuple(options.only))
    ]
    looks = Looks(options.data, ours.success_range)
    samples = looks.of(ours.network)
    sides = split(samples, ours)
    none = sides.training[:0]
    sides = replace(sides, test=none, new_sizes=none)
    rows, name = sides.validation, "validation"
    trained = make_trainings(
        choices, seeds=options.seeds, looks=looks, sides=sides, groups={name: rows}, out=options.out
    )
    each = {choice: [one[name] for one in found] for choice, found in trained.items()}
    rate = float(samples.success[sides.training].double().mean())
    scores = {
        choice: scores_of(samples, rows, each[choice], rate) for choice in progress(list(each), unit="choice")
    }
    errors = {choice: errors_of(samples, rows, found) for choice, found in each.items()}
    relative = {choice: changes(one, errors[OURS]) for choice, one in errors.items() if choice != OURS}
    details = {choice: details_of(samples, rows, found) for choice, found in each.items()}
    title = f"Validation parts: {len(rows)} grasps of {scores[OURS].parts} parts, seeds: {options.seeds}"
    tables = [
        score_table(scores, bold=OURS, caption=title),
        detail_table(details),
        coverage_table(scores),
        change_table(relative, f"Change of the error relative to {OURS}"),
    ]
    values = {choice: one.to_json() | details[choice] for choice, one in scores.items()}
    show(
        tables,
        options.out,
        {"scores": values, "seeds": options.seeds} | facts(samples, share(samples, sides)),
    )
    return 0


def _some(samples: Samples, sides: Sides, *, share: float) -> Sides:
    return replace(sides, training=some_rows(sides.training, share))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.ablation",
        description="Train our networks with one choice of configs/train/pretrained.yaml undone at a time.",
    )
    parser.add_argument("--data", type=Path, required=True, help="dataset folder")
    parser.add_argument("--out", type=Path, required=True, help="folder of trainings, report.json, report.md")
    parser.add_argument("--gqn-epochs", type=int, default=8)
    parser.add_argument("--gdn-epochs", type=int, default=16)
    parser.add_argument(
        "--share", type=float, default=1.0, help="of the attempts to learn from; the paper's network is slow"
    )
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each choice")
    parser.add_argument("--only", nargs="*", help="how the names of the wanted choices begin")
    parser.add_argument("--threads", type=int, default=1, help="of this process (default 1)")
    return parser.parse_args()


if __name__ == "__main__":
    cli.run("ablation", main)
