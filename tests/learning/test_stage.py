"""Training of one network: its steps and what it learns from."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from mskgrasp.learning.config import StageConfig
from mskgrasp.learning.grasp_models import build_models
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.sides import split
from mskgrasp.learning.stage import Stage
from mskgrasp.learning.trainer import describe_networks
from tests import synthetic
from tests.learning.small import HAND, PATCH, SHORT


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


def test_the_seed_decides_where_normalised_blocks_start(samples_of_the_hand):
    samples, network = samples_of_the_hand
    started = []
    for seed, before in ((0, 1), (0, 2), (1, 1)):
        config = HAND.model_copy(
            update={
                "seed": seed, "network": network, "gdn": HAND.gdn.model_copy(update={"batch_norm": True}),
            }
        )  # fmt: skip
        sides = split(samples, config)
        torch.manual_seed(0)
        models = build_models(describe_networks(samples, sides.training, config))
        torch.manual_seed(before)
        state = torch.get_rng_state()
        stage = Stage("gdn", models, samples, sides, config)
        assert torch.equal(torch.get_rng_state(), state)
        started.append(torch.cat([one.flatten() for one in stage.network.features.parameters()]))
    assert torch.equal(started[0], started[1]) and not torch.equal(started[0], started[2])


@pytest.fixture
def samples_of_the_hand(dataset):
    network = HAND.network.model_copy(update={"displacement_blocks": (0, 1)})
    return read_samples(dataset, network), network


def test_curves_are_of_random_grasps_and_the_loss_is_of_all(dataset, tmp_path):
    random = read_samples(dataset, PATCH.network)
    more = read_samples(synthetic.write_dataset(tmp_path, n_parts=8, n_attempts=40, seed=3), PATCH.network)
    both = random.joined(dataclasses.replace(more, planned=torch.ones(len(more), dtype=torch.bool)))
    sides = split(both, SHORT)
    of_random = dataclasses.replace(sides, validation=both.random_of(sides.validation))
    assert 0 < len(of_random.validation) < len(sides.validation)
    models = build_models(describe_networks(both, sides.training, SHORT))
    for name, shown in (("gqn", ["auroc"]), ("gdn", ["translation_rmse", "rotation_rmse"])):
        all_of, some = (Stage(name, models, both, one, SHORT)._validate() for one in (sides, of_random))
        assert [all_of[key] for key in shown] == pytest.approx([some[key] for key in shown], rel=1e-9)
        assert all_of["validation_loss"] != some["validation_loss"]


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
