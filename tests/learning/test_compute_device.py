"""Networks on a GPU: skipped where there is none."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.errors import UsageError
from mskgrasp.learning.compute_device import compute_device
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import load_models, save_model
from mskgrasp.learning.held_out import predict_grasp_displacement, predict_quality
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.trainer import train
from tests.learning.small import HAND, SHORT
from tests.learning.test_trainer import StopAfter

on_a_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
SAME_M, SAME_RAD = 2e-6, 2e-5
"""Greatest difference by rounding of displacements up to centimetres and radians."""
MIXTURE = HAND.model_copy(
    update={
        "network": HAND.network.model_copy(update={"mixture": 2, "swing": True, "dropout": 0.2}),
        "beta": 0.0,
        "gqn": HAND.gqn.model_copy(update={"epochs": 2}),
        "gdn": HAND.gdn.model_copy(update={"epochs": 2, "batch_norm": True, "weight_decay": 0.1}),
    }
)
BOTH = pytest.mark.parametrize("config", [SHORT, MIXTURE], ids=["patch", "hand"])


def test_auto_takes_a_gpu_where_there_is_one():
    assert compute_device().type == ("cuda" if torch.cuda.is_available() else "cpu")
    assert compute_device("cpu").type == "cpu"


@pytest.mark.skipif(torch.cuda.is_available(), reason="a CUDA device")
def test_a_gpu_that_is_not_there_is_refused():
    with pytest.raises(UsageError, match="no CUDA device is available; legal here: auto, cpu"):
        compute_device("cuda")


@on_a_gpu
def test_the_shipped_model_predicts_as_on_a_cpu(dataset):
    here, there = (load_models(device=compute_device(name)) for name in ("cpu", "cuda"))
    samples = read_samples(dataset, here.meta.network)
    rows = torch.arange(len(samples))
    np.testing.assert_allclose(
        predict_quality(there, samples, rows), predict_quality(here, samples, rows), atol=1e-5
    )
    held = rows[samples.success]
    (mean, variance), (mean_there, variance_there) = (
        predict_grasp_displacement(models, samples, held) for models in (here, there)
    )
    np.testing.assert_allclose(mean_there[:, :3], mean[:, :3], atol=SAME_M)
    np.testing.assert_allclose(mean_there[:, 3:], mean[:, 3:], atol=SAME_RAD)
    np.testing.assert_allclose(variance_there, variance, rtol=1e-3)


@on_a_gpu
@BOTH
def test_a_training_on_a_gpu_repeats_and_resumes_to_the_same_weights(dataset, tmp_path, config):
    samples, device = read_samples(dataset, config.network), compute_device("cuda")
    whole, again = (
        train(samples, config, checkpoint_path=tmp_path / name, device=device)[0] for name in ("a", "b")
    )
    with pytest.raises(KeyboardInterrupt):
        train(samples, config, checkpoint_path=tmp_path / "c", device=device, reporter=StopAfter(3))
    resumed, _ = train(samples, config, checkpoint_path=tmp_path / "c", device=device)
    for other in (again, resumed):
        for network in ("gqn", "gdn"):
            weights, others = (getattr(models, network).state_dict() for models in (whole, other))
            assert all(torch.equal(weights[name], others[name]) for name in weights)


@on_a_gpu
@BOTH
def test_a_model_trained_on_a_gpu_learns_as_on_a_cpu_and_predicts_there(dataset, tmp_path, config):
    samples = read_samples(dataset, config.network)
    quiet: LearningConfig = config.model_copy(
        update={
            "noise_std": 0.0,
            "symmetric": False,
            "network": config.network.model_copy(update={"dropout": 0.0, "symmetric_views": False}),
            "gdn": config.gdn.model_copy(update={"epochs": 1}),
        }
    )
    losses = {}
    for name in ("cpu", "cuda"):
        models, history = train(samples, quiet, checkpoint_path=tmp_path / name, device=compute_device(name))
        losses[name] = [one.train_loss for one in history]
    # Augmentation, noise and dropout draw other numbers; without them only rounding differs, which grows
    # with every epoch.
    np.testing.assert_allclose(losses["cuda"], losses["cpu"], rtol=0.02)
    save_model(tmp_path / "model", models)
    rows = torch.nonzero(samples.success)[:, 0]
    mean, _ = predict_grasp_displacement(load_models(tmp_path / "model"), samples, rows)
    np.testing.assert_allclose(
        mean[:, :3], predict_grasp_displacement(models, samples, rows)[0][:, :3], atol=SAME_M
    )
