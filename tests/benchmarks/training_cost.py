"""Time that a training takes, predicted from a few of its steps, and how much of it is left."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from torch import Tensor

from mskgrasp.learning import held_out
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.config import DeviceName
from mskgrasp.learning.grasp_models import Models, build_models
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides
from mskgrasp.learning.stage import Reporter, Stage
from mskgrasp.learning.trainer import describe_networks
from mskgrasp.runtime.console_table import Table
from mskgrasp.runtime.progress import Bar, progress
from tests.benchmarks.choice import Choice, Looks
from tests.benchmarks.train_speed import rate


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Predicted time of a training, from a few measured steps.

    Attributes:
        batch_s: Seconds a batch by network, ``gqn`` and ``gdn``.
        validation_s: Seconds of an epoch's validation, likewise.
        total_s: Seconds of all epochs.
        samples_per_s: Samples learned from a second, likewise.
        samples: Samples of an epoch, likewise.
    """

    batch_s: dict[str, float]
    validation_s: dict[str, float]
    total_s: float
    samples_per_s: dict[str, float]
    samples: dict[str, int]


def cost_of(
    choice: Choice, samples: Samples, sides: Sides, seconds: float, device: DeviceName = "cpu"
) -> Cost:
    """Measure some steps of each network of a choice, ``seconds`` each, on weights that are thrown away."""
    models = (choice.build or build_models)(describe_networks(samples, sides.training, choice.config))
    models.gqn.to(compute_device(device))
    models.gdn.to(compute_device(device))
    batch, validation, rates, counts, total = {}, {}, {}, {}, 0.0
    for name in choice.stages():
        stage = Stage(name, models, samples, sides, choice.config)
        stage.network.train()
        rates[name], counts[name] = rate(stage, stage.learn, seconds), stage.n_samples
        stage.network.eval()
        rows = sides.validation
        predict: Callable[[Models, Samples, Tensor], object] = held_out.predict_quality
        if name == "gdn":
            rows, predict = rows[samples.success[rows]], held_out.predict_grasp_displacement
        began = time.perf_counter()
        predict(models, samples, rows[:256])
        validation[name] = (time.perf_counter() - began) * len(rows) / min(256, len(rows))
        batch[name] = stage.settings.batch_size / rates[name]
        total += stage.settings.epochs * (stage.batches * batch[name] + validation[name])
    return Cost(batch_s=batch, validation_s=validation, total_s=total, samples_per_s=rates, samples=counts)


class TimeLeft(Reporter):
    """Advances a bar over all trainings by the predicted seconds of what is done."""

    def __init__(self, bar: Bar, cost: Cost):
        self._bar, self._cost = bar, cost
        self._start, self._done, self._name = bar.n, 0.0, ""

    def stage(self, name: str, *, epochs: int, batches: int, done: int) -> None:
        self._name = name
        self._advance(done * self._cost.batch_s[name])

    def batch(self, loss: float) -> None:
        self._advance(self._cost.batch_s[self._name])

    def epoch(self, history: list[EpochMetrics]) -> None:
        self._advance(self._cost.validation_s[self._name])

    def close(self) -> None:
        """Count the whole training as done, where it ended early, too."""
        self._advance(self._cost.total_s - self._done)

    def _advance(self, seconds: float) -> None:
        self._done += seconds
        self._bar.update(round(self._start + self._done) - self._bar.n)


def cost_table(
    choices: Sequence[Choice],
    looks: Looks,
    sides: Sides,
    *,
    seconds: float,
    device: DeviceName = "cpu",
) -> Table:
    """The table of measured rates and predicted hours of a training, a row a choice.

    Args:
        choices: What would be trained.
        looks: The samples.
        sides: Attempts to train on.
        seconds: Time for which each network's steps are measured.
        device: Device of the networks.
    """
    header = ("one seed", "quality: samples/s", "an epoch", "displacement: samples/s", "an epoch", "hours")
    rows = []
    for choice in progress(choices, unit="network"):
        samples = choice.samples(looks.of(choice.config.network))
        cost = cost_of(choice, samples, choice.sides(samples, sides), seconds, device)
        cells: list[str | None] = [choice.name]
        for stage in ("gqn", "gdn"):
            known = stage in cost.samples
            cells.append(f"{cost.samples_per_s[stage]:.0f}" if known else None)
            cells.append(f"{cost.samples[stage]}" if known else None)
        rows.append((*cells, f"{cost.total_s / 3600:.2f}"))
    return Table(header=header, rows=rows)


def add_cost_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how much is trained, and what it would take."""
    parser.add_argument("--threads", type=int, default=1, help="of this process (default 1)")
    parser.add_argument("--quick", action="store_true", help="one seed, two epochs: tries the command")
    parser.add_argument("--estimate", action="store_true", help="print how long each network takes, and end")
    parser.add_argument("--measure", type=float, default=10.0, help="seconds a network for --estimate")
