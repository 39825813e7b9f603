"""Training of the GQN and then of the GDN, which resumes from a checkpoint with identical results.

In between, if asked for, the layers of the GDN learn the quality, from attempts that failed, too.
"""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from mskgrasp.core import metrics
from mskgrasp.core.errors import BadDataset, MskgraspError, UsageError
from mskgrasp.learning import held_out
from mskgrasp.learning.batch_norm import add_batch_norms, fold_batch_norms
from mskgrasp.learning.checkpoint import (
    Checkpoint,
    optimiser_tensors,
    read_checkpoint,
    restore_checkpoint,
    write_checkpoint,
)
from mskgrasp.learning.config import LearningConfig, StageConfig
from mskgrasp.learning.cuda_graphs import GraphedStep
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.network_config import Normalisation
from mskgrasp.learning.networks import (
    GraspDisplacementNetwork,
    GraspQualityNetwork,
    displacement_loss,
    with_noise,
)
from mskgrasp.learning.samples import SAMPLES_VERSION, Samples, part_sides
from mskgrasp.learning.sides import Sides, split
from mskgrasp.learning.symmetry import mirror_and_turn
from mskgrasp.parts.catalogue import SPLITS

_LEAST_TARGET_STD = (1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3)
"""Least deviation of a target, metres and radians: less (parts that never rise) is simulation noise."""
_RECORDED = {"train": "training"}
"""Names of sides in a model's record, where they differ."""


class TrainingDiverged(MskgraspError):
    """The loss is not finite."""


class Reporter:
    """Receiver of training progress; this one ignores it."""

    def stage(self, name: str, *, epochs: int, batches: int, done: int) -> None:
        """Start a network's training, or resume it after ``done`` batches."""

    def batch(self, loss: float) -> None:
        """Report the loss of a batch."""

    def epoch(self, history: list[EpochMetrics]) -> None:
        """Report a finished and saved epoch, the last of the history."""


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


def stages_of(models: Models, config: LearningConfig) -> dict[str, Models]:
    """Names of the networks that are trained, in order, with the models that each belongs to.

    That of ``transfer`` is the quality network of models of their own, on the same device: a new one with the
    layers and the input of the displacement network.
    """
    if config.transfer is None:
        return {"gqn": models, "gdn": models}
    meta = models.meta.model_copy(update={"network": models.meta.network.of_displacement})
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(config.seed)
        gqn = GraspQualityNetwork(meta.network, meta.normalisation)
    before = Models(gqn=gqn.to(models.device), gdn=models.gdn, meta=meta)
    return {"gqn": models, "transfer": before, "gdn": models}


class Stage:
    """Training of one network: ``gqn``, ``transfer`` or ``gdn``, of which the first two learn the quality."""

    def __init__(
        self,
        name: str,
        models: Models,
        samples: Samples,
        sides: Sides,
        config: LearningConfig,
    ):
        self.name = name
        self.models, self.samples, self.config = models, samples, config
        self.training_rows, self.rows = sides.training, sides.validation
        self.seen = samples.on(models.device)
        self.noise = torch.Generator(models.device)
        self.of_quality = name != "gdn"
        network = models.gqn if self.of_quality else models.gdn
        network.features.mixed_precision = config.mixed_precision
        self.network: GraspQualityNetwork | GraspDisplacementNetwork = network
        self.settings: StageConfig = getattr(config, name)
        n_success = int(samples.success[self.training_rows].sum())
        n_failure = len(self.training_rows) - n_success
        self.n_each = min(n_success, n_failure)
        self.n_samples = 2 * self.n_each if self.of_quality else n_success
        self.batches = math.ceil(self.n_samples / self.settings.batch_size)
        if self.settings.batch_norm:
            if self.n_samples < 2:
                raise BadDataset("batch_norm: true needs two successes at the training parts; collect more")
            add_batch_norms(network.features)
        on_a_gpu = models.device.type == "cuda"
        parameters, rate = list(self.network.parameters()), self.settings.learning_rate
        if on_a_gpu:  # what a graph reads has to lie there
            rate = torch.tensor(rate, device=models.device)
        self.optimiser: torch.optim.Optimizer
        if self.settings.optimiser == "adam":
            layers = [one for one in parameters if one.ndim > 1]
            others = [one for one in parameters if one.ndim == 1]
            groups = [
                {"params": layers, "weight_decay": self.settings.weight_decay},
                {"params": others, "weight_decay": 0.0},
            ]
            self.optimiser = torch.optim.AdamW(groups, lr=rate, capturable=on_a_gpu)
        else:
            # Keras's constants: the paper's learning rate was chosen for them.
            self.optimiser = torch.optim.RMSprop(
                parameters, lr=rate, alpha=0.9, eps=1e-7, capturable=on_a_gpu
            )
        self._take_step: Callable[[Tensor], Tensor] = self._step
        if on_a_gpu:
            self._take_step = GraphedStep(self._step, network, self.optimiser, self.noise)

    def learning_rate(self, step: int) -> float:
        """Compute the learning rate of a step, counted from the start of training."""
        s = self.settings
        rate = s.learning_rate / (1 + s.decay * step)
        if s.schedule == "cosine":
            total = s.epochs * self.batches
            warm = max(1, total // 20)
            rate *= min(1.0, (step + 1) / warm) * 0.5 * (1 + math.cos(math.pi * step / total))
        return rate

    def epoch(self, number: int, reporter: Reporter) -> EpochMetrics:
        """Train one epoch and validate."""
        started = time.perf_counter()
        device = self.models.device
        # Every epoch seeds its own generators, so that a checkpoint needs to store only its number.
        seed = zlib.crc32(f"{self.config.seed} {self.name} {number}".encode())
        order = torch.Generator().manual_seed(seed)
        self.noise.manual_seed(seed)
        losses = []
        with torch.random.fork_rng(devices=[device] if device.type == "cuda" else []):
            torch.manual_seed(seed)  # dropout takes no generator
            self.network.train()
            for index, rows in enumerate(self.order(order).to(device).tensor_split(self.batches)):
                self._set_rate(self.learning_rate(number * self.batches + index))
                losses.append(self.learn(rows))
                if not math.isfinite(losses[-1]):
                    raise TrainingDiverged(
                        f"the {self.name}'s loss became {losses[-1]} in epoch {number + 1}; train into "
                        f"another --out with {self.name}.learning_rate below {self.settings.learning_rate:g}"
                    )
                reporter.batch(losses[-1])
            self.network.eval()
        return EpochMetrics(
            stage=self.name,
            epoch=number + 1,
            train_loss=sum(losses) / len(losses),
            **self._validate(),
            seconds=round(time.perf_counter() - started, 2),
        )

    def order(self, generator: torch.Generator) -> Tensor:
        """Draw the rows of an epoch in random order: for the quality as many failures as successes."""
        success = self.samples.success[self.training_rows]
        kinds = (self.training_rows[success], self.training_rows[~success])
        if self.of_quality:
            kinds = tuple(
                rows[torch.randperm(len(rows), generator=generator)][: self.n_each] for rows in kinds
            )
            rows = torch.cat(kinds)
        else:
            rows = kinds[0]
        return rows[torch.randperm(len(rows), generator=generator)]

    def batch(self, rows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Get patches, object centres, displacements and successes of some rows.

        Augmented by rotation, mirroring and noise, on the networks' device.
        """
        s, device = self.seen, self.models.device
        if self.of_quality:
            patches = s.quality_patches_of(rows, device, self.models.meta.network)
        else:
            patches = s.displacement_patches_of(rows, device)
        centre, target = s.centre_grasp[rows], s.targets(rows, self.config.network)
        if self.config.symmetric:
            patches, centre, target = mirror_and_turn(patches, centre, target, self.noise)
        if self.config.noise_std > 0:
            patches = with_noise(patches, self.config.noise_std, self.noise)
        return patches, centre, target, s.success[rows]

    def learn(self, rows: Tensor) -> float:
        """Take one step of the optimiser; return the loss before it."""
        return float(self._take_step(rows))

    def _step(self, rows: Tensor) -> Tensor:
        patches, centre, target, success = self.batch(rows)
        height, theta = self.seen.height[rows], self.seen.theta[rows]
        if self.of_quality:
            loss = nn.functional.cross_entropy(self.models.gqn(patches, centre, height), success.long())
        else:
            loss = self.models.gdn.loss(patches, centre, height, theta, target, self.config.beta)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        self.optimiser.step()
        return loss.detach()

    def _set_rate(self, rate: float) -> None:
        for group in self.optimiser.param_groups:
            if isinstance(group["lr"], Tensor):
                group["lr"].fill_(rate)
            else:
                group["lr"] = rate

    def finish(self, weights: dict[str, Tensor]) -> None:
        """Give the network the weights of an epoch and its final layers; nothing can be learned after it."""
        self.network.load_state_dict(weights)
        fold_batch_norms(self.network.features)

    def _validate(self) -> dict[str, float]:
        if self.of_quality:
            success = self.samples.success[self.rows].double()
            quality = torch.from_numpy(held_out.predict_quality(self.models, self.samples, self.rows))
            # The loss is that of balanced data: the correction to the base rate is undone.
            logit = torch.logit(quality, eps=1e-12) - self.models.gqn.log_prior_odds.cpu()
            each = nn.functional.binary_cross_entropy_with_logits(logit, success, reduction="none")
            balanced = (each[success > 0].mean() + each[success == 0].mean()) / 2
            return {
                "validation_loss": float(balanced),
                "auroc": metrics.auroc(quality.numpy(), success.numpy() > 0),
            }
        rows = self.rows[self.samples.success[self.rows]]
        mean, variance = held_out.predict_grasp_displacement(self.models, self.samples, rows)
        predicted = torch.from_numpy(variance) if self.config.network.variance else None
        std = self.models.gdn.target_std.cpu().double()
        target = self.samples.targets(rows, self.config.network).double()
        loss = displacement_loss(torch.from_numpy(mean), predicted, target, std)
        errors = held_out.prediction_errors(self.samples, rows, mean, variance)
        return {
            "validation_loss": float(loss),
            "translation_rmse": errors.translation_rmse,
            "rotation_rmse": errors.rotation_rmse,
        }


def _epochs_since_best(losses: list[float]) -> int:
    """Epochs after that of the lowest validation loss; the first of equal ones counts."""
    return len(losses) - 1 - losses.index(min(losses)) if losses else 0


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
        UsageError: The checkpoint was made from other data, with another version of the samples, or with a
            transfer that is not wanted.
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
    stages = stages_of(models, config)
    networks: dict[str, nn.Module] = {
        name: one.gdn if name == "gdn" else one.gqn for name, one in stages.items()
    }
    saved = read_checkpoint(checkpoint_path) if checkpoint_path.exists() else None
    if saved is not None and saved.fingerprint != samples.fingerprint:
        raise UsageError(f"{checkpoint_path} was made from other data; choose another --out or delete it")
    if saved is not None and saved.samples_version != SAMPLES_VERSION:
        raise UsageError(
            f"{checkpoint_path} was made with version {saved.samples_version} of the samples, this is "
            f"version {SAMPLES_VERSION}; choose another --out or delete it"
        )
    if saved is not None and saved.stage not in stages:
        raise UsageError(f"{checkpoint_path} was made with other settings; choose another --out or delete it")

    history: list[EpochMetrics] = list(saved.history) if saved else []
    for name in list(stages)[list(stages).index(saved.stage) if saved else 0 :]:
        network = networks[name]
        if quality is not None and name == "gqn":
            network.load_state_dict(quality.state_dict())
            continue
        if name == "gdn" and config.transfer is None:
            models.gdn.start_from(models.gqn)
        elif name == "gdn":
            models.gdn.features.load_state_dict(stages["transfer"].gqn.features.state_dict())
        stage = Stage(name, stages[name], samples, sides, config)
        best: dict[str, Tensor] = {}
        done = 0
        if saved is not None and saved.stage == name:
            restore_checkpoint(saved, networks, stage.optimiser)
            best, done = saved.best, saved.epoch
        reporter.stage(name, epochs=stage.settings.epochs, batches=stage.batches, done=done * stage.batches)
        for number in range(done, stage.settings.epochs):
            earlier = [one.validation_loss for one in history if one.stage == name]
            if stage.settings.patience is not None and _epochs_since_best(earlier) >= stage.settings.patience:
                break
            found = stage.epoch(number, reporter)
            history.append(found)
            if not config.keep_best or found.validation_loss <= min(earlier, default=math.inf):
                best = {key: value.detach().clone() for key, value in network.state_dict().items()}
            write_checkpoint(
                checkpoint_path,
                Checkpoint(
                    fingerprint=samples.fingerprint,
                    samples_version=SAMPLES_VERSION,
                    stage=name,
                    epoch=number + 1,
                    history=history,
                    weights={
                        f"{n}.{k}": v for n, net in networks.items() for k, v in net.state_dict().items()
                    },
                    best=best,
                    optimiser=optimiser_tensors(stage.optimiser),
                ),
            )
            reporter.epoch(history)
        stage.finish(best)

    if config.calibrate:
        found = held_out.calibrate(models, samples, sides.validation)
        models = replace(models, meta=meta.model_copy(update={"calibration": found}))
    stored = held_out.measure_models(models, samples, sides.training, sides.validation).to_json()
    for side, rows in (("test", sides.test), ("new_sizes", sides.new_sizes)):
        if len(rows):
            stored[side] = held_out.measure_models(models, samples, sides.training, rows).to_json()
    return replace(models, meta=models.meta.model_copy(update={"metrics": stored})), history
