"""The shipped displacement network, tuned to known parts. Run: python -m tests.benchmarks.tuned --help.

Training goes on with grasps recorded at the parts that the network is to be used for. The folder that it
writes is a model, which `mskgrasp.evaluate` puts beside the shipped one: ``--compare tuned=out/tuned``.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import torch
from torch import Tensor

from mskgrasp.core.config import read_config
from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models, load_models, save_model
from mskgrasp.learning.held_out import calibrate
from mskgrasp.learning.samples import Samples, read_samples
from mskgrasp.learning.sides import Sides
from mskgrasp.learning.trainer import describe_networks
from mskgrasp.parts.names import SPLITS
from mskgrasp.runtime import cli
from mskgrasp.runtime.progress import advance_to, progress
from tests.benchmarks.choice import Choice
from tests.benchmarks.paper_choices import CONFIGS, with_stages
from tests.benchmarks.training_cost import TimeLeft, cost_of
from tests.benchmarks.trainings import displacement_trained

HELD_OUT_EVERY = 5
"""One in so many attempts selects the epoch and calibrates."""


def tuned(samples: Samples, config: LearningConfig, attempts: int) -> Models:
    """Tune the shipped displacement network to the parts of a dataset.

    Args:
        samples: Grasps of the parts.
        config: Settings of the shipped model; the epochs and the rate of ``gdn`` are those of the tuning.
        attempts: Number of attempts at each part that are used.
    """
    sides = _sides(samples, attempts)
    shipped = load_models(PRETRAINED)

    def start(meta: ModelMeta) -> Models:
        return load_models(PRETRAINED).uncalibrated()  # the epoch is selected by what is trained

    cost = cost_of(Choice(name="tuned", config=config, build=start), samples, sides, 2.0)
    with progress(unit="s", total=round(cost.total_s), title="tune") as bar:
        models = displacement_trained(start, config, samples, sides, TimeLeft(bar, cost))
    training = describe_networks(samples, sides.training, config).training
    # Attempts are held out, no part.
    training |= {f"{side}_parts": [] for side in SPLITS if side != "train"}
    training["training_parts"] = list(samples.parts)
    meta = shipped.meta.model_copy(update={"training": training, "metrics": {}})
    models = replace(models, meta=meta)
    found = calibrate(models, samples, sides.validation)
    # The quality network is the shipped one; its calibration rests on far more attempts.
    kept = {name: getattr(meta.calibration, name) for name in ("quality_slope", "quality_offset")}
    return replace(models, meta=meta.model_copy(update={"calibration": found.model_copy(update=kept)}))


def _sides(samples: Samples, attempts: int) -> Sides:
    rows = [torch.nonzero(samples.part == part)[:attempts, 0] for part in range(len(samples.parts))]
    few = min(map(len, rows))
    if few < attempts:
        raise UsageError(f"{few} attempts at a part, {attempts} are needed; collect more")
    held: list[Tensor] = [one[::HELD_OUT_EVERY] for one in rows]
    everything, validation = torch.cat(rows), torch.cat(held)
    training = everything[~torch.isin(everything, validation)]
    none = everything[:0]
    return Sides(training=training, validation=validation, test=none, new_sizes=none)


def main() -> int:
    """Tunes, and writes the model."""
    options = _options()
    torch.set_num_threads(options.threads)
    config = read_config(LearningConfig, CONFIGS / "pretrained.yaml")
    # The shipped network's batch normalisation is part of its weights.
    config = with_stages(config, epochs=options.epochs, learning_rate=options.learning_rate, batch_norm=False)
    config = config.model_copy(update={"sides": "name"})  # no catalogue is needed
    with progress(title="read shards", unit="shard") as bar:
        samples = read_samples(options.data, config.network, advance=partial(advance_to, bar))
    cli.make_folder(options.out)
    save_model(options.out, tuned(samples, config, options.attempts))
    print(f"tuned to {len(samples.parts)} parts: {options.out}")
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.tuned",
        description="Tune the shipped displacement network to the parts of a dataset.",
    )
    parser.add_argument("--data", type=Path, required=True, help="dataset folder, of these parts alone")
    parser.add_argument("--out", type=Path, required=True, help="folder of the model")
    parser.add_argument("--attempts", type=int, default=400, help="used of each part (default 400)")
    parser.add_argument("--epochs", type=int, default=30, help="(default 30)")
    parser.add_argument("--learning-rate", type=float, default=3e-4, help="(default 0.0003)")
    parser.add_argument("--threads", type=int, default=1, help="(default 1)")
    return parser.parse_args()


if __name__ == "__main__":
    cli.run("tuned", main)
