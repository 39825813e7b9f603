"""Checkpoint of a training run, from which it resumes exactly: one file without pickle."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from mskgrasp.core.errors import BadModel
from mskgrasp.core.files import write_whole
from mskgrasp.learning.model_metrics import EpochMetrics


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """State after a finished epoch.

    Attributes:
        fingerprint: Digest of the data's grasps and outcomes; training does not resume with others.
        samples_version: Version of the samples made from the data; 1 in files that do not name it.
        sides: Digest of the split (`Sides.digest`); empty in files that do not name it.
        stage: Network that is being trained.
        epoch: Epochs of that stage that are finished.
        history: Metrics of all epochs so far.
        weights: Weights of all networks.
        best: Weights of the stage's network at its lowest validation loss.
        optimiser: State of the stage's optimiser.
    """

    fingerprint: str
    samples_version: int
    sides: str
    stage: str
    epoch: int
    history: list[EpochMetrics]
    weights: dict[str, Tensor]
    best: dict[str, Tensor]
    optimiser: dict[str, Tensor]


_GROUPS = ("weights", "best", "optimiser")


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Replace the checkpoint at ``path``: a kill at any moment leaves the old or the new one."""
    tensors = {
        f"{group}/{name}": value.detach().cpu().contiguous().clone()
        for group in _GROUPS
        for name, value in getattr(checkpoint, group).items()
    }
    names = ("fingerprint", "samples_version", "sides", "stage", "epoch")
    progress = {name: getattr(checkpoint, name) for name in names}
    progress["history"] = [one.to_json() for one in checkpoint.history]
    write_whole(path, save(tensors, metadata={"progress": json.dumps(progress)}))


def read_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises:
        BadModel: It is damaged.
    """
    try:
        with safe_open(path, framework="pt") as file:
            progress: dict[str, Any] = {"samples_version": 1, "sides": ""}
            progress |= json.loads(file.metadata()["progress"])
            groups: dict[str, dict[str, Tensor]] = {group: {} for group in _GROUPS}
            for key in file.keys():
                group, name = key.split("/", 1)
                groups[group][name] = file.get_tensor(key)
        history = [EpochMetrics(**one) for one in progress["history"]]
        values: dict[str, Any] = progress | groups | {"history": history}
        return Checkpoint(**values)
    except (SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
        raise BadModel(f"{path} is damaged ({error}); delete it to train from the beginning") from error


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Named tensors of an optimiser's state."""
    state = optimiser.state_dict()["state"]
    return {f"{index}/{name}": value for index, values in state.items() for name, value in values.items()}


def restore_checkpoint(
    checkpoint: Checkpoint, networks: dict[str, nn.Module], optimiser: torch.optim.Optimizer
) -> None:
    """Restore a checkpoint's weights and optimiser state, in place.

    Raises:
        BadModel: They do not fit the networks.
    """
    try:
        for name, network in networks.items():
            prefix = f"{name}."
            network.load_state_dict(
                {k.removeprefix(prefix): v for k, v in checkpoint.weights.items() if k.startswith(prefix)}
            )
        values = optimiser.state_dict()
        values["state"] = {}
        for key, value in checkpoint.optimiser.items():
            index, name = key.split("/", 1)
            values["state"].setdefault(int(index), {})[name] = value
        optimiser.load_state_dict(values)
        for parameter, state in optimiser.state.items():  # which it does not compare
            if any(one.ndim and one.shape != parameter.shape for one in state.values()):
                raise ValueError("the optimiser's state is that of other layers")
    except (RuntimeError, ValueError) as error:
        problem = str(error).splitlines()[0]
        raise BadModel(f"the checkpoint does not fit ({problem}); delete it to start again") from error
