"""Training of the GQN and then of the GDN, which resumes from a checkpoint with identical results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from mskgrasp.core.errors import UsageError
from mskgrasp.learning import held_out
from mskgrasp.learning.checkpoint import (
    Checkpoint,
    optimiser_tensors,
    read_checkpoint,
    restore_checkpoint,
    write_checkpoint,
)
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.network_config import Normalisation
from mskgrasp.learning.networks import GraspQualityNetwork
from mskgrasp.learning.samples import SAMPLES_VERSION, Samples
from mskgrasp.learning.sides import Sides, part_sides, split
from mskgrasp.learning.stage import Reporter, Stage
from mskgrasp.parts.names import SPLITS

_LEAST_TARGET_STD = (1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3)
"""Least deviation of a target, metres and radians: less (parts that never rise) is simulation noise."""
_RECORDED = {"train": "training"}
"""Names of sides in a model's record, where they differ."""


def describe_networks(samples: Samples, training_rows: Tensor, config: LearningConfig) -> ModelMeta:
    """Describe the networks, with the normalisation measured on the training parts."""
    success = samples.success[training_rows]
    target = samples.targets(training_rows[success], config.network).double()
    scale = samples.centre_grasp[training_rows].abs().amax(dim=0).clamp(min=1e-3)
    least = torch.tensor(_LEAST_TARGET_STD[: config.network.n_outputs]).double()
    std, mean = target.std(dim=0, correction=0), target.mean(dim=0)
    if config.symmetric:
        # Rotated and mirrored copies make all but z symmetric about zero.
        rise, rise_std = mean[2].clone(), std[2].clone()
        std, mean = target.square().mean(dim=0).sqrt(), torch.zeros_like(mean)
        std[2], mean[2] = rise_std, rise
    std = torch.maximum(std, least)
    sides = part_sides(samples.parts, config.validation_fraction, config.sides)
    return ModelMeta(
        network=config.network,
        normalisation=Normalisation(
            action_scale=tuple(scale.tolist()),
            target_mean=tuple(mean.tolist()),
            target_std=tuple(std.tolist()),
            base_rate=float(success.double().mean()),
        ),
        labels=samples.sources,
        training={
            "attempts": len(training_rows),
            "successes": int(success.sum()),
            **{
                f"{_RECORDED.get(side, side)}_parts": [name for name in samples.parts if sides[name] == side]
                for side in SPLITS
            },
            "skipped": samples.skipped,
            "data_fingerprint": samples.fingerprint,
            "samples_version": SAMPLES_VERSION,
            # Without the paths of data and model, which mean nothing elsewhere.
            "settings": config.model_dump(mode="json", include=set(LearningConfig.model_fields)),
        },
    )


def train(
    samples: Samples,
    config: LearningConfig,
    *,
    checkpoint_path: Path,
    device: torch.device | str = "cpu",
    reporter: Reporter | None = None,
    sides: Sides | None = None,
    quality: GraspQualityNetwork | None = None,
) -> tuple[Models, list[EpochMetrics]]:
    """Train both networks, from a checkpoint if there is one.

    Args:
        samples: The dataset.
        config: Settings.
        checkpoint_path: Replaced after every epoch.
        device: Device of the networks.
        reporter: Receives the progress.
        sides: Split of the samples; None: according to the settings.
        quality: A trained quality network of the same settings, which is copied; None: one is trained.

    Returns:
        The networks with their metrics on held-out parts, and those of each epoch.

    Raises:
        BadDataset: The data cannot be split, or lack successes or failures.
        UsageError: The checkpoint was made from other data, with another version or split of the samples, or
            with other settings.
        TrainingDiverged: The loss is not finite.
    """
    reporter = reporter or Reporter()
    sides = sides or split(samples, config)
    meta = describe_networks(samples, sides.training, config)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        models = build_models(meta)
    models.gqn.to(device)
    models.gdn.to(device)
    networks: dict[str, nn.Module] = {"gqn": models.gqn, "gdn": models.gdn}
    saved = _resumable(checkpoint_path, samples, sides, list(networks))
    history: list[EpochMetrics] = list(saved.history) if saved else []
    seen = samples.on(models.device)  # once: a stage outlives its training until garbage is collected
    for name in list(networks)[list(networks).index(saved.stage) if saved else 0 :]:
        if quality is not None and name == "gqn":
            models.gqn.load_state_dict(quality.state_dict())
            continue
        if name == "gdn":
            models.gdn.start_from(models.gqn)
        stage = Stage(name, models, samples, sides, config, seen=seen)
        best: dict[str, Tensor] = {}
        done = 0
        if saved is not None and saved.stage == name:
            restore_checkpoint(saved, networks, stage.optimiser)
            best, done = saved.best, saved.epoch

        def save(finished: int, best: dict[str, Tensor], stage: Stage = stage) -> None:
            checkpoint = Checkpoint(
                fingerprint=samples.fingerprint,
                samples_version=SAMPLES_VERSION,
                sides=sides.digest,
                stage=stage.name,
                epoch=finished,
                history=history,
                weights={f"{n}.{k}": v for n, net in networks.items() for k, v in net.state_dict().items()},
                best=best,
                optimiser=optimiser_tensors(stage.optimiser),
            )
            write_checkpoint(checkpoint_path, checkpoint)

        stage.run(history, reporter, done=done, best=best, save=save)

    return _measured(models, samples, sides, config), history


def _measured(models: Models, samples: Samples, sides: Sides, config: LearningConfig) -> Models:
    """Trained networks with their calibration, if it is wanted, and their metrics on held-out parts."""
    if config.calibrate:
        found = held_out.calibrate(models, samples, sides.validation)
        models = replace(models, meta=models.meta.model_copy(update={"calibration": found}))
    # Of random grasps, so that models can be compared whether they learned from planned ones or not.
    random = samples.random_of(sides.validation)
    stored = held_out.measure_models(models, samples, sides.training, random).to_json()
    for side, rows in (("test", sides.test), ("new_sizes", sides.new_sizes)):
        if len(rows):
            stored[side] = held_out.measure_models(models, samples, sides.training, rows).to_json()
    return replace(models, meta=models.meta.model_copy(update={"metrics": stored}))


def _resumable(path: Path, samples: Samples, sides: Sides, stages: list[str]) -> Checkpoint | None:
    """The checkpoint that the training goes on with; None where there is none.

    Raises:
        UsageError: It was made from other data, with another version or split of the samples, or with other
            settings.
    """
    if not path.exists():
        return None
    saved = read_checkpoint(path)
    remedy = "choose another --out or delete it"
    if saved.fingerprint != samples.fingerprint:
        raise UsageError(f"{path} was made from other data; {remedy}")
    if saved.samples_version != SAMPLES_VERSION:
        raise UsageError(
            f"{path} was made with version {saved.samples_version} of the samples, this is version "
            f"{SAMPLES_VERSION}; {remedy}"
        )
    if saved.sides != sides.digest:
        raise UsageError(
            f"{path} was made with other parts to train on or to validate on (the catalogue may have "
            f"changed), or does not name them; {remedy}"
        )
    if saved.stage not in stages:
        raise UsageError(f"{path} was made with other settings; {remedy}")
    return saved
