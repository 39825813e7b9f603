"""Training of one network: its steps and what it learns from."""

from __future__ import annotations

import pytest
import torch

from mskgrasp.learning.config import StageConfig
from mskgrasp.learning.grasp_models import build_models
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.sides import split
from mskgrasp.learning.stage import Stage
from mskgrasp.learning.trainer import describe_networks
from tests.learning.small import PATCH, SHORT


def test_decay_shrinks_weights_of_layers_by_its_share_of_the_rate_and_no_biases(samples):
    rows = torch.arange(8)
    after = {}
    for decay in (0.0, 0.5):
        stage = StageConfig(
            learning_rate=0.01, schedule="constant", epochs=1, batch_size=8, weight_decay=decay
        )
        config = SHORT.model_copy(update={"gqn": stage})
        sides = split(samples, config)
        torch.manual_seed(0)
        models = build_models(describe_networks(samples, sides.training, config))
        before = {name: value.clone() for name, value in models.gqn.named_parameters()}
        Stage("gqn", models, samples, sides, config).learn(rows)
        after[decay] = models.gqn.state_dict()
    for name, value in before.items():
        shrunk = 0.005 * value if value.ndim > 1 else torch.zeros_like(value)
        assert torch.allclose(after[0.0][name] - after[0.5][name], shrunk, atol=1e-7)


def test_the_papers_optimiser_decays_no_weights():
    with pytest.raises(ValueError, match="weight_decay: 0.1 needs optimiser: adam"):
        StageConfig(optimiser="rmsprop", weight_decay=0.1)


def test_a_picture_of_the_whole_part_is_that_of_the_samples(dataset):
    network = PATCH.network.model_copy(update={"image": "object"})
    samples = read_samples(dataset, network)
    assert samples.object_patches.shape == samples.patches.shape
    config = SHORT.model_copy(update={"network": network, "symmetric": False})
    rows = torch.arange(8)
    sides = split(samples, config)
    models = build_models(describe_networks(samples, sides.training, config))
    stage = Stage("gdn", models, samples, sides, config)
    inputs = stage.batch(rows)[0]
    assert inputs.shape == (8, 1, 40, 40)
