import os

import pytest
import torch

from mskgrasp.core.errors import BadModel
from mskgrasp.learning.checkpoint import (
    Checkpoint,
    optimiser_tensors,
    read_checkpoint,
    restore_checkpoint,
    write_checkpoint,
)
from mskgrasp.learning.model_metrics import EpochMetrics
from tests.learning.small import small_models


def stepped(seed: int = 0, steps: int = 2):
    """A network and its optimiser after some steps."""
    network = small_models(seed).gqn.train()
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-2)
    for _ in range(steps):
        step(network, optimiser)
    return network, optimiser


def step(network, optimiser) -> None:
    optimiser.zero_grad()
    sum(parameter.square().sum() for parameter in network.parameters()).backward()
    optimiser.step()


def epoch_metrics(epoch: int) -> EpochMetrics:
    return EpochMetrics(stage="gqn", epoch=epoch, train_loss=0.5, validation_loss=0.6, auroc=0.7, seconds=1.2)


def checkpoint_of(network, optimiser, epoch: int = 3) -> Checkpoint:
    return Checkpoint(
        fingerprint="abc",
        samples_version=7,
        sides="def",
        stage="gqn",
        epoch=epoch,
        history=[epoch_metrics(epoch)],
        weights={f"gqn.{name}": value for name, value in network.state_dict().items()},
        best=network.state_dict(),
        optimiser=optimiser_tensors(optimiser),
    )


def test_a_restored_optimiser_takes_the_same_next_step(tmp_path):
    network, optimiser = stepped()
    path = tmp_path / "checkpoint.safetensors"
    write_checkpoint(path, checkpoint_of(network, optimiser))
    saved = read_checkpoint(path)
    assert (saved.fingerprint, saved.samples_version, saved.stage, saved.epoch) == ("abc", 7, "gqn", 3)
    assert saved.sides == "def"
    assert saved.history == [epoch_metrics(3)]
    other, fresh = stepped(seed=1, steps=0)
    restore_checkpoint(saved, {"gqn": other}, fresh)
    step(network, optimiser)
    step(other, fresh)
    for one, two in zip(network.parameters(), other.parameters(), strict=True):
        assert torch.equal(one, two)


def test_a_crash_while_writing_leaves_the_last_checkpoint(tmp_path, monkeypatch):
    network, optimiser = stepped()
    path = tmp_path / "checkpoint.safetensors"
    write_checkpoint(path, checkpoint_of(network, optimiser, epoch=1))

    def crash(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", crash)
    with pytest.raises(OSError, match="No space"):
        write_checkpoint(path, checkpoint_of(network, optimiser, epoch=2))
    assert read_checkpoint(path).epoch == 1


@pytest.mark.parametrize("share", [0.0, 0.1, 0.9])
def test_a_damaged_checkpoint_is_named_with_the_remedy(tmp_path, share):
    path = tmp_path / "checkpoint.safetensors"
    write_checkpoint(path, checkpoint_of(*stepped()))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(BadModel, match=r"checkpoint.safetensors is damaged .* delete it") as caught:
        read_checkpoint(path)
    assert "\n" not in str(caught.value)


def test_a_checkpoint_of_another_network_is_refused(tmp_path):
    network, optimiser = stepped()
    saved = checkpoint_of(network, optimiser)
    wider = small_models(head_width=9).gqn
    with pytest.raises(BadModel, match="does not fit") as caught:
        restore_checkpoint(saved, {"gqn": wider}, torch.optim.Adam(wider.parameters()))
    assert "\n" not in str(caught.value)
