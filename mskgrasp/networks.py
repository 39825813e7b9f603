"""The two networks: how likely a grasp lifts the part, and how the part shifts when it does."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from pydantic import Field, ValidationError, field_validator
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from mskgrasp.config import Config
from mskgrasp.errors import BadModel
from mskgrasp.geometry import wrap_angle

SCHEMA_VERSION = 1
WEIGHTS = "model.safetensors"
DESCRIPTION = "model.json"
STANDARDISE_EPSILON = 1e-4
"""Metres added to a patch's standard deviation: the resolution of a stored depth."""
_LOG_VARIANCE_LIMIT = 12.0
"""Bounds of the log variance in normalised units: a deviation of 0.25 % to 400 times the data's own."""


class NetworkConfig(Config):
    """Architecture; the defaults are the paper's (figure 3).

    The paper does not state the padding. Convolutions are "valid", the default of Keras at the time.
    """

    patch_pixels: int = Field(default=64, ge=32, le=256)
    patch_side: float = Field(default=0.128, gt=0.0, le=1.0)
    channels: int = Field(default=32, ge=1)
    trunk_width: int = Field(default=1024, ge=1)
    action_width: int = Field(default=64, ge=1)
    head_width: int = Field(default=512, ge=1)
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)
    variance: bool = True
    """False: the displacement network predicts the mean alone (the paper's GCIP-M)."""
    least_std: tuple[float, float] = (0.0, 0.0)
    """Deviation, metres and radians, below which no displacement is claimed to be known (paper: none).

    Most parts do not rise in the hand by 0.1 mm, some rise by 10 mm: without a floor the likelihood drives
    the variance of z so low that one such part costs more than all others gain.
    """

    @field_validator("least_std")
    @classmethod
    def _not_negative(cls, values: tuple[float, float]) -> tuple[float, float]:
        if not all(0 <= value < float("inf") for value in values):
            raise ValueError("deviations must not be negative")
        return values


class Normalisation(Config):
    """Numbers from the training data that turn network units into metres, radians and probabilities."""

    action_scale: tuple[float, float, float]
    """Largest distance of the object centre from the grasp along each axis, metres."""
    target_mean: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    target_std: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Of the grasp displacement, metres and radians."""
    base_rate: float = Field(default=0.5, gt=0.0, lt=1.0)
    """Share of successes among the attempts; training shows the network as many of either kind."""

    @field_validator("action_scale", "target_std")
    @classmethod
    def _positive(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0 < value < float("inf") for value in values):
            raise ValueError("scales must be positive and finite")
        return values


def preprocess(
    patches: Tensor, *, noise_std: float = 0.0, generator: torch.Generator | None = None
) -> Tensor:
    """Makes height patches what the networks take (paper, section 4.2).

    Args:
        patches: (n, 1, p, p) metres above the table.
        noise_std: Standard deviation of the uncorrelated noise added to each pixel, metres; training only.
        generator: Source of that noise, on the device of the patches.

    Returns:
        (n, 1, p, p), each patch of zero mean and about unit standard deviation.
    """
    if noise_std > 0:
        noise = torch.empty_like(patches).normal_(0.0, noise_std, generator=generator)
        patches = patches + noise
    centred = patches - patches.mean(dim=(1, 2, 3), keepdim=True)
    return centred / (centred.square().mean(dim=(1, 2, 3), keepdim=True).sqrt() + STANDARDISE_EPSILON)


class GraspFeatures(nn.Module):
    """What both networks share in shape, not in weights: a patch and an action become one vector."""

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        width = config.channels
        self.convolutions = nn.Sequential(
            nn.Conv2d(1, width, 5),
            nn.ReLU(),
            nn.Conv2d(width, width, 5),
            nn.ReLU(),
            nn.MaxPool2d(2),
            nn.Conv2d(width, width, 5),
            nn.ReLU(),
            nn.Conv2d(width, width, 5),
            nn.ReLU(),
            nn.MaxPool2d(2),
        )
        left = ((config.patch_pixels - 8) // 2 - 8) // 2
        dropout = nn.Dropout(config.dropout)
        self.image = nn.Sequential(
            nn.Flatten(), nn.Linear(width * left * left, config.trunk_width), nn.ReLU(), dropout
        )
        self.action = nn.Sequential(nn.Linear(3, config.action_width), nn.ReLU(), dropout)
        self.n_features = config.trunk_width + config.action_width
        self.action_scale: Tensor
        self.register_buffer("action_scale", torch.tensor(normalisation.action_scale), persistent=False)

    def forward(self, patches: Tensor, centre_grasp: Tensor) -> Tensor:
        """Features (n, f) of preprocessed patches (n, 1, p, p) and object centres (n, 3), metres."""
        image = self.image(self.convolutions(patches))
        return torch.cat([image, self.action(centre_grasp / self.action_scale)], dim=-1)


def _head(n_features: int, config: NetworkConfig, n_outputs: int) -> nn.Sequential:
    hidden = nn.Linear(n_features, config.head_width)
    return nn.Sequential(
        hidden, nn.ReLU(), nn.Dropout(config.dropout), nn.Linear(config.head_width, n_outputs)
    )


class GraspQualityNetwork(nn.Module):
    """GQN: the probability that a grasp lifts the part (paper, section 3.4)."""

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        self.features = GraspFeatures(config, normalisation)
        self.head = _head(self.features.n_features, config, 2)
        odds = normalisation.base_rate / (1 - normalisation.base_rate)
        self.log_prior_odds: Tensor
        self.register_buffer("log_prior_odds", torch.tensor(odds).log(), persistent=False)

    def forward(self, patches: Tensor, centre_grasp: Tensor) -> Tensor:
        """Logits (n, 2) of failure and success among balanced data.

        Args:
            patches: (n, 1, p, p), preprocessed.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
        """
        return self.head(self.features(patches, centre_grasp))

    def quality(self, logits: Tensor) -> Tensor:
        """Probabilities (n,) of success, corrected from balanced data to the true share of successes."""
        return torch.sigmoid(logits[:, 1] - logits[:, 0] + self.log_prior_odds)


class GraspDisplacementNetwork(nn.Module):
    """GDN: a Gaussian over the grasp displacement of a successful grasp (paper, section 3.4)."""

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        self.features = GraspFeatures(config, normalisation)
        self.mean_head = _head(self.features.n_features, config, 4)
        self.variance_head = _head(self.features.n_features, config, 4) if config.variance else None
        self.target_mean: Tensor
        self.target_std: Tensor
        self.register_buffer("target_mean", torch.tensor(normalisation.target_mean), persistent=False)
        self.register_buffer("target_std", torch.tensor(normalisation.target_std), persistent=False)
        metres, radians = config.least_std
        self.least_variance: Tensor
        floor = torch.tensor([metres, metres, metres, radians]).square()
        self.register_buffer("least_variance", floor, persistent=False)

    def forward(self, patches: Tensor, centre_grasp: Tensor) -> tuple[Tensor, Tensor | None]:
        """Mean (n, 4) and variance (n, 4) of the grasp displacement, in metres and radians (squared).

        A network that predicts the mean alone gives None for the variance.

        Args:
            patches: (n, 1, p, p), preprocessed.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
        """
        features = self.features(patches, centre_grasp)
        mean = self.target_mean + self.target_std * self.mean_head(features)
        if self.variance_head is None:
            return mean, None
        # The bound keeps one odd batch from driving the exponential to infinity or to zero.
        log_variance = self.variance_head(features).clamp(-_LOG_VARIANCE_LIMIT, _LOG_VARIANCE_LIMIT)
        return mean, self.target_std.square() * log_variance.exp() + self.least_variance

    def start_from(self, gqn: GraspQualityNetwork) -> None:
        """Copies the convolutions' weights of a trained GQN (paper, figure 3)."""
        self.features.convolutions.load_state_dict(gqn.features.convolutions.state_dict())


def displacement_error(mean: Tensor, target: Tensor) -> Tensor:
    """Target minus mean (n, 4), the angle wrapped."""
    error = target - mean
    return torch.cat([error[..., :3], wrap_angle(error[..., 3:])], dim=-1)


def displacement_loss(
    mean: Tensor, variance: Tensor | None, target: Tensor, target_std: Tensor, *, beta: float = 0.0
) -> Tensor:
    """Equation 5 of the paper, averaged over the batch: sum of log variance + squared error / variance.

    Both are taken in normalised units (a constant apart, the same), so that a loss near 4 means "no
    better than the training mean". Without variances it is the squared error.

    Args:
        mean: (n, 4) predicted grasp displacement.
        variance: (n, 4) or None.
        target: (n, 4).
        target_std: (4,) the training data's deviation.
        beta: 0 is the paper's loss; 0.5 weighs each term by its variance's square root, which fits the
            mean better where it is hard (Seitzer et al. 2022, arXiv 2203.09168).
    """
    squared = (displacement_error(mean, target) / target_std).square()
    if variance is None:
        return squared.sum(dim=-1).mean()
    variance = variance / target_std.square()
    terms = variance.log() + squared / variance
    if beta > 0:
        terms = terms * variance.detach().pow(beta)
    return terms.sum(dim=-1).mean()


class ModelMeta(Config):
    """What ``model.json`` says about the weights beside it."""

    schema_version: int = SCHEMA_VERSION
    network: NetworkConfig
    normalisation: Normalisation
    training: dict[str, Any] = {}
    metrics: dict[str, Any] = {}


@dataclass(frozen=True)
class Models:
    """A trained pair of networks, in evaluation mode, with their description."""

    gqn: GraspQualityNetwork
    gdn: GraspDisplacementNetwork
    meta: ModelMeta

    @property
    def device(self) -> torch.device:
        """Where the weights lie."""
        return next(self.gqn.parameters()).device

    @torch.inference_mode()
    def quality(self, patches: Tensor, centre_grasp: Tensor) -> Tensor:
        """Probability of success (n,) of height patches (n, 1, p, p) in metres and centres (n, 3)."""
        self._check(patches)
        return self.gqn.quality(self.gqn(self._inputs(patches), centre_grasp.to(patches.dtype)))

    @torch.inference_mode()
    def grasp_displacement(self, patches: Tensor, centre_grasp: Tensor) -> tuple[Tensor, Tensor | None]:
        """Mean and variance (n, 4) of the grasp displacement, of patches (n, 1, p, p) in metres."""
        self._check(patches)
        return self.gdn(self._inputs(patches), centre_grasp.to(patches.dtype))

    def _inputs(self, patches: Tensor) -> Tensor:
        # Measured on a CPU: channels last takes about 40 % off the time of the convolutions.
        return preprocess(patches).contiguous(memory_format=torch.channels_last)

    def _check(self, patches: Tensor) -> None:
        p = self.meta.network.patch_pixels
        if tuple(patches.shape[1:]) != (1, p, p):
            raise BadModel(f"patches have shape {tuple(patches.shape)}, this model takes (n, 1, {p}, {p})")


def build_models(meta: ModelMeta, device: torch.device | str = "cpu") -> Models:
    """Networks with fresh weights, in evaluation mode."""
    gqn = GraspQualityNetwork(meta.network, meta.normalisation)
    gdn = GraspDisplacementNetwork(meta.network, meta.normalisation)
    for network in (gqn, gdn):
        network.to(device=device, memory_format=torch.channels_last).eval()  # pyright: ignore
    return Models(gqn, gdn, meta)


def save_model(folder: Path, models: Models) -> None:
    """Writes ``model.safetensors`` and ``model.json``, each whole or not at all.

    Raises:
        BadModel: A weight is not finite.
    """
    weights = _weights(models)
    _check_finite(weights, "the trained networks", "train again with a lower learning rate")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / (WEIGHTS + ".tmp")
    save_file({name: value.contiguous().cpu() for name, value in weights.items()}, temporary)
    temporary.chmod(0o644)  # safetensors makes it readable for its owner alone
    os.replace(temporary, folder / WEIGHTS)
    temporary = folder / (DESCRIPTION + ".tmp")
    temporary.write_text(json.dumps(models.meta.model_dump(mode="json"), indent=2) + "\n", encoding="utf-8")
    os.replace(temporary, folder / DESCRIPTION)


def load_models(folder: Path, device: torch.device | str = "cpu") -> Models:
    """Reads a model folder.

    Raises:
        BadModel: It is missing, damaged, of another schema, or the weights do not fit the description.
    """
    folder = Path(folder)
    for name in (DESCRIPTION, WEIGHTS):
        if not (folder / name).is_file():
            raise BadModel(f"no {name} in {folder}; train a model: python -m mskgrasp.train --out {folder}")
    meta = _read_meta(folder / DESCRIPTION)
    path = folder / WEIGHTS
    try:
        weights = load_file(path)
    except (SafetensorError, OSError) as error:
        raise BadModel(f"{path} is damaged ({error}); copy it again or train again") from error
    models = build_models(meta)
    expected = _weights(models)
    for name in sorted(expected.keys() ^ weights.keys()):
        state = "lacks" if name in expected else "has the unknown"
        raise BadModel(f"{path} {state} weight {name}; it does not belong to the {DESCRIPTION} beside it")
    for name, value in expected.items():
        if weights[name].shape != value.shape:
            raise BadModel(
                f"{path}: {name} has shape {tuple(weights[name].shape)}, {DESCRIPTION} (patches of "
                f"{meta.network.patch_pixels} pixels) needs {tuple(value.shape)}; use the pair that was saved"
            )
    _check_finite(weights, str(path), "train again")
    with torch.no_grad():
        for name, value in expected.items():
            value.copy_(weights[name])
    models.gqn.to(device)
    models.gdn.to(device)
    return models


def _read_meta(path: Path) -> ModelMeta:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadModel(f"{path} is damaged ({error}); copy it again or train again") from error
    version = values.get("schema_version") if isinstance(values, dict) else None
    if version != SCHEMA_VERSION:
        raise BadModel(f"{path} has schema version {version}, legal: {SCHEMA_VERSION}; train again")
    try:
        return ModelMeta.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadModel(f"{path}: '{key}': {first['msg'].lower()}; copy it again or train again") from error


def _weights(models: Models) -> dict[str, Tensor]:
    pairs = (("gqn", models.gqn), ("gdn", models.gdn))
    return {f"{name}.{key}": value for name, net in pairs for key, value in net.state_dict().items()}


def _check_finite(weights: dict[str, Tensor], source: str, remedy: str) -> None:
    for name, value in weights.items():
        if not torch.isfinite(value).all():
            raise BadModel(f"{source}: weight {name} is not finite; {remedy}")
