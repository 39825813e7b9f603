"""Ablations of our network. Run: python -m tests.benchmarks.ablation --help.

Every line trains both networks anew on the same attempts, with one choice of configs/train/default.yaml
undone, and scores them on the validation parts, which training never saw; test parts are not looked at.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from mskgrasp.core.config import read_config
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.learning.samples import Samples, read_samples
from mskgrasp.learning.trainer import Sides, split, train
from mskgrasp.runtime.progress import progress

REPOSITORY = Path(__file__).parents[2]


def variants(ours: LearningConfig) -> dict[str, LearningConfig]:
    """Our configuration, and the same with one choice undone."""
    paper = read_config(LearningConfig, REPOSITORY / "configs" / "train" / "paper.yaml").network

    def with_(**changes: Any) -> LearningConfig:
        network = changes.pop("network", {})
        return ours.model_copy(update=changes | {"network": ours.network.model_copy(update=network)})

    assert isinstance(paper, PatchNetworkConfig)
    paper = paper.model_copy(update={"symmetric_views": ours.network.symmetric_views})
    return {
        "ours": ours,
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
            }
        ),
        "quality with twice the channels at first": with_(network={"layers": (16, 32)}),
        "half the channels": with_(network={"layers": (4, 16), "displacement_layers": (8, 16, 16)}),
        "twice the channels": with_(network={"layers": (16, 64), "displacement_layers": (32, 64, 64)}),
        "no half turns and mirror images": with_(symmetric=False, network={"symmetric_views": False}),
        "one view of each grasp": with_(network={"symmetric_views": False}),
        "the swing is predicted, too": with_(network={"swing": True}),
        "plain likelihood (beta 0)": with_(beta=0.0),
        "beta 1": with_(beta=1.0),
        "no noise": with_(noise_std=0.0),
        "no floor of the deviations": with_(network={"least_std": (0.0, 0.0)}),
        "no dropout": with_(network={"dropout": 0.0}),
        "not calibrated": with_(calibrate=False),
        "mixed precision": with_(mixed_precision=True),
    }


def main() -> None:
    """Prints a row a choice and, last, one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, required=True, help="dataset folder")
    parser.add_argument("--gqn-epochs", type=int, default=8)
    parser.add_argument("--gdn-epochs", type=int, default=16)
    parser.add_argument(
        "--share", type=float, default=1.0, help="of the attempts to learn from; the paper's network is slow"
    )
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each choice")
    parser.add_argument("--only", nargs="*", help="how the names of the wanted choices begin")
    options = parser.parse_args()
    torch.set_num_threads(min(2, os.cpu_count() or 1))
    ours = read_config(LearningConfig, REPOSITORY / "configs" / "train" / "default.yaml")
    ours = ours.model_copy(
        update={
            "gqn": ours.gqn.model_copy(update={"epochs": options.gqn_epochs}),
            "gdn": ours.gdn.model_copy(update={"epochs": options.gdn_epochs}),
        }
    )
    chosen = {
        name: config
        for name, config in variants(ours).items()
        if not options.only or name.startswith(tuple(options.only))
    }
    known: dict[tuple[int, int, float], Samples] = {}
    found, spread = {}, {}
    for name, config in progress(chosen.items(), unit="choice"):
        look = (*config.network.patch_shape, config.network.patch_side)
        if look not in known:
            known[look] = read_samples(options.data, config.network).of_parts_between(*config.success_range)
        each = [
            score(known[look], config.model_copy(update={"seed": seed}), options.share)
            for seed in range(options.seeds)
        ]
        found[name] = {key: float(np.mean([one[key] for one in each])) for key in each[0]}
        spread[name] = {key: float(np.std([one[key] for one in each])) for key in each[0]}
        Console(width=150, stderr=True).print(name, found[name])
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("choice")
    for column in next(iter(found.values())):
        table.add_column(column, justify="right")
    for name, values in found.items():
        table.add_row(name, *(_cell(value, spread[name][key]) for key, value in values.items()))
    Console(width=190).print(table)
    print(json.dumps({"mean": found, "deviation over seeds": spread}))


def _cell(value: float, spread: float) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{value:.3g} +- {spread:.2g}" if spread > 0 else f"{value:.3g}"


def score(samples: Samples, config: LearningConfig, share: float) -> dict[str, float]:
    """Metrics on the validation parts of networks freshly trained on a share of the others."""
    sides = split(samples, config)
    drawn = torch.randperm(len(sides.training), generator=torch.Generator().manual_seed(0))
    training = sides.training[drawn[: round(share * len(drawn))].sort().values]
    none = training[:0]
    sides = Sides(training=training, validation=sides.validation, test=none, new_sizes=none)
    with tempfile.TemporaryDirectory() as folder:
        models, _ = train(samples, config, checkpoint_path=Path(folder) / "checkpoint", sides=sides)
    gqn, gdn = models.meta.metrics["gqn"], models.meta.metrics["gdn"]
    surest = gdn["least_uncertain"]["10%"]
    return {
        "accuracy %": 100 * gqn["balanced_accuracy"],
        "AUROC": gqn["auroc"],
        "Brier": gqn["brier"],
        "mm": 1e3 * gdn["translation_rmse"],
        "deg": float(np.degrees(gdn["rotation_rmse"])),
        "NLL": gdn["nll"],
        "90 % holds": 100 * float(np.mean(list(gdn["coverage_90"].values()))),
        "AUSE": gdn["ause_translation"],
        "surest 10 %, mm": 1e3 * surest[0],
        "surest 10 %, deg": float(np.degrees(surest[1])),
        "surest 10 %, tilted %": 100 * surest[2],
    }


if __name__ == "__main__":
    main()
