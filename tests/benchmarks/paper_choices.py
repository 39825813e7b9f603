"""The paper's networks and ours as choices of one comparison."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from mskgrasp.core.config import read_config
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides
from tests.benchmarks.choice import Choice

CONFIGS = Path(__file__).parents[2] / "configs" / "train"
PAPER = "GCIP-M+V"
"""The paper's model: patches around the grasp, mean and variance."""
PAPER_AS_OURS = f"{PAPER}, our recipe"
OURS = "ours"
_QUICK_ATTEMPTS = 1000


def paper_choices(
    patience: int,
    *,
    mixed_precision: bool = False,
    paper_seeds: int | None = None,
    displacement_only: bool = False,
) -> list[Choice]:
    """The paper's four networks by its own recipe and by ours, and ours.

    By a recipe the four share one quality network. Half turns and mirror images are part of our recipe where
    patches are rotated with the grasp.

    Args:
        patience: Epochs without a lower validation loss after which any of them stops.
        mixed_precision: The image layers of the paper's architecture train in bfloat16, which is faster on
            a CPU that computes with it.
        paper_seeds: Greatest number of trainings by the paper's recipe, each of which takes four times as
            long as by ours.
        displacement_only: By the paper's recipe no quality network is trained: that by our recipe, which then
            comes first, stands in its place.
    """
    paper, ours = (read_config(LearningConfig, CONFIGS / f"{name}.yaml") for name in ("paper", "pretrained"))
    same = {"sides": "catalogue", "success_range": paper.success_range, "keep_best": True}
    paper, ours = (with_stages(config.model_copy(update=same), patience=patience) for config in (paper, ours))
    paper = paper.model_copy(update={"mixed_precision": mixed_precision})
    assert isinstance(paper.network, PatchNetworkConfig)
    by_its_own, by_ours = [], []
    for name, image, variance in (
        (PAPER, "grasp", True), ("GCIP-M", "grasp", False),
        ("OCFI-M+V", "object", True), ("OCFI-M", "object", False),
    ):  # fmt: skip
        network = paper.network.model_copy(update={"image": image, "variance": variance})
        config = paper.model_copy(update={"network": network})
        quality_of = PAPER_AS_OURS if displacement_only else "" if name == PAPER else PAPER
        by_its_own.append(Choice(name=name, config=config, quality_of=quality_of, most_seeds=paper_seeds))
        symmetric = ours.symmetric and image == "grasp"
        views = network.model_copy(update={"symmetric_views": ours.network.symmetric_views and symmetric})
        config = ours.model_copy(
            update={"network": views, "symmetric": symmetric, "mixed_precision": mixed_precision}
        )
        quality_of = "" if name == PAPER else PAPER_AS_OURS
        by_ours.append(Choice(name=f"{name}, our recipe", config=config, quality_of=quality_of))
    own = Choice(name=OURS, config=ours)
    return [*by_ours, *by_its_own, own] if displacement_only else [*by_its_own, *by_ours, own]


def with_stages(config: LearningConfig, **changes: object) -> LearningConfig:
    """A configuration with changed optimisation of all networks."""
    return config.model_copy(
        update={name: getattr(config, name).model_copy(update=changes) for name in ("gqn", "gdn")}
    )


def quick(choice: Choice) -> Choice:
    """A choice with two epochs on few attempts, to try the command: its figures mean nothing."""
    return replace(choice, config=with_stages(choice.config, epochs=2), sides=_few)


def _few(samples: Samples, sides: Sides) -> Sides:
    training, validation = (
        rows[:: max(1, len(rows) // _QUICK_ATTEMPTS)] for rows in (sides.training, sides.validation)
    )
    return replace(sides, training=training, validation=validation)


def some_rows(rows: Tensor, share: float) -> Tensor:
    """A random share of rows, the same every time, in order."""
    drawn = torch.randperm(len(rows), generator=torch.Generator().manual_seed(0))
    return rows[drawn[: round(share * len(rows))].sort().values]
