"""Recorded training steps: skipped where there is no GPU."""

from __future__ import annotations

import pytest
import torch

from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.cuda_graphs import GraphedStep
from mskgrasp.learning.grasp_models import build_models
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.sides import split
from mskgrasp.learning.stage import Stage
from mskgrasp.learning.trainer import describe_networks
from tests.learning.small import HAND

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")


def test_recorded_steps_learn_as_steps_that_are_started_one_by_one(dataset):
    config = HAND.model_copy(update={"noise_std": 0.0, "symmetric": False})
    config = config.model_copy(update={"gdn": config.gdn.model_copy(update={"batch_norm": True})})
    samples = read_samples(dataset, config.network)
    sides = split(samples, config)
    held = sides.training[samples.success[sides.training]].to("cuda")
    states = []
    for graphed in (False, True):
        torch.manual_seed(0)
        models = build_models(describe_networks(samples, sides.training, config), compute_device("cuda"))
        stage = Stage("gdn", models, samples, sides, config)
        stage.network.train()
        step = (
            GraphedStep(stage._step, stage.network, stage.optimiser, stage.noise) if graphed else stage._step
        )
        for size, start in ((16, 0), (15, 16), (16, 31), (15, 47)):  # two sizes of batch
            step(held[start : start + size])
        adam = stage.optimiser.state_dict()["state"]
        states.append(
            [*stage.network.state_dict().values(), *(v for one in adam.values() for v in one.values())]
        )
    for plain, recorded in zip(*states, strict=True):
        torch.testing.assert_close(recorded, plain, rtol=1e-4, atol=1e-6)
