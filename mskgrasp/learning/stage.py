"""Training of one network, epoch by epoch."""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Callable

import torch
from torch import Tensor, nn

from mskgrasp.core import metrics
from mskgrasp.core.errors import BadDataset, BadModel, MskgraspError
from mskgrasp.learning import held_out
from mskgrasp.learning.batch_norm import add_batch_norms, fold_batch_norms
from mskgrasp.learning.config import LearningConfig, StageConfig
from mskgrasp.learning.cuda_graphs import GraphedStep
from mskgrasp.learning.grasp_models import Models
from mskgrasp.learning.model_metrics import EpochMetrics
from mskgrasp.learning.networks import (
    GraspDisplacementNetwork,
    GraspQualityNetwork,
    displacement_loss,
    with_noise,
)
from mskgrasp.learning.samples import Samples
from mskgrasp.learning.sides import Sides
from mskgrasp.learning.symmetry import mirror_and_turn


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


class Stage:
    """Training of one network: ``gqn`` or ``gdn``."""

    def __init__(
        self,
        name: str,
        models: Models,
        samples: Samples,
        sides: Sides,
        config: LearningConfig,
        *,
        seen: Samples | None = None,
    ):
        """Prepare the training.

        Args:
            name: Of the network.
            models: Those that it belongs to.
            samples: The dataset.
            sides: Split of the samples.
            config: Settings.
            seen: The samples on the models' device, shared with other stages; None: copied there.
        """
        self.name = name
        self.models, self.samples, self.config = models, samples, config
        self.training_rows, self.rows = sides.training, sides.validation
        self.seen = samples.on(models.device) if seen is None else seen
        self.noise = torch.Generator(models.device)
        self.of_quality = name == "gqn"
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
            with torch.random.fork_rng(devices=[]):
                torch.manual_seed(zlib.crc32(f"{config.seed} {name}".encode()))
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

    def run(
        self,
        history: list[EpochMetrics],
        reporter: Reporter,
        *,
        done: int = 0,
        best: dict[str, Tensor] | None = None,
        save: Callable[[int, dict[str, Tensor]], None] = lambda *_: None,
    ) -> None:
        """Train all epochs that are left, and give the network the weights of the best, or of the last.

        Args:
            history: Metrics of the epochs so far, of other networks', too; those of this one are added.
            reporter: Receives the progress.
            done: Epochs that are finished.
            best: Weights at the lowest validation loss of these.
            save: Called after every epoch with the number of those that are finished, and the best weights.
        """
        best = best or {}
        reporter.stage(self.name, epochs=self.settings.epochs, batches=self.batches, done=done * self.batches)
        for number in range(done, self.settings.epochs):
            earlier = [one.validation_loss for one in history if one.stage == self.name]
            if self.settings.patience is not None and _epochs_since_best(earlier) >= self.settings.patience:
                break
            found = self.epoch(number, reporter)
            history.append(found)
            if not self.config.keep_best or found.validation_loss < min(earlier, default=math.inf):
                best = {key: value.detach().clone() for key, value in self.network.state_dict().items()}
            save(number + 1, best)
            reporter.epoch(history)
        self.finish(best)

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
                    raise self._diverged(f"loss became {losses[-1]}", number)
                reporter.batch(losses[-1])
            self.network.eval()
        try:
            validated = self._validate()
        except BadModel as error:
            raise self._diverged("predictions are not finite", number) from error
        return EpochMetrics(
            stage=self.name,
            epoch=number + 1,
            train_loss=sum(losses) / len(losses),
            **validated,
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

    def _diverged(self, what: str, number: int) -> TrainingDiverged:
        return TrainingDiverged(
            f"the {self.name}'s {what} in epoch {number + 1}; train into another --out with "
            f"{self.name}.learning_rate below {self.settings.learning_rate:g}"
        )

    def _validate(self) -> dict[str, float]:
        """The loss of all held-out rows, and metrics of random grasps, as in ``metrics.json``."""
        random = ~self.samples.planned[self.rows]
        if self.of_quality:
            success = self.samples.success[self.rows].double()
            quality = torch.from_numpy(held_out.predict_quality(self.models, self.samples, self.rows))
            # The loss is that of balanced data: the correction to the base rate is undone.
            logit = torch.logit(quality, eps=1e-12) - self.models.gqn.log_prior_odds.cpu()
            each = nn.functional.binary_cross_entropy_with_logits(logit, success, reduction="none")
            balanced = (each[success > 0].mean() + each[success == 0].mean()) / 2
            return {
                "validation_loss": float(balanced),
                "auroc": metrics.auroc(quality[random].numpy(), success[random].numpy() > 0),
            }
        held = self.samples.success[self.rows]
        rows, random = self.rows[held], random[held]
        mean, variance = held_out.predict_grasp_displacement(self.models, self.samples, rows)
        predicted = torch.from_numpy(variance) if self.config.network.variance else None
        std = self.models.gdn.target_std.cpu().double()
        target = self.samples.targets(rows, self.config.network).double()
        loss = displacement_loss(torch.from_numpy(mean), predicted, target, std)
        mean, variance = mean[random.numpy()], variance[random.numpy()]
        errors = held_out.prediction_errors(self.samples, rows[random], mean, variance)
        return {
            "validation_loss": float(loss),
            "translation_rmse": errors.translation_rmse,
            "rotation_rmse": errors.rotation_rmse,
        }


def _epochs_since_best(losses: list[float]) -> int:
    """Epochs after that of the lowest validation loss; the first of equal ones counts."""
    return len(losses) - 1 - losses.index(min(losses)) if losses else 0
