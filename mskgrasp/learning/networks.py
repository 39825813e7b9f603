"""Grasp quality network, grasp displacement network, and the loss of the latter."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.learning.hand_features import HandFeatures, image_autocast
from mskgrasp.learning.network_config import NetworkConfig, Normalisation, PatchNetworkConfig

STANDARDISE_EPSILON = 1e-4
"""Metres added to a patch's standard deviation: the resolution of a stored depth."""
_LOG_VARIANCE_LIMIT = 12.0
"""Bounds of the log variance in normalised units: a deviation of 0.25 % to 400 times the data's own."""


def with_noise(patches: Tensor, std: float, generator: torch.Generator) -> Tensor:
    """Add uncorrelated Gaussian noise to patches (n, 1, r, c), for training; ``std`` in their unit."""
    return patches + torch.empty_like(patches).normal_(0.0, std, generator=generator)


def standardise(patches: Tensor) -> Tensor:
    """Scale each patch (n, 1, p, p) to zero mean and about unit deviation (paper, section 4.2)."""
    centred = patches - patches.mean(dim=(1, 2, 3), keepdim=True)
    return centred / (centred.square().mean(dim=(1, 2, 3), keepdim=True).sqrt() + STANDARDISE_EPSILON)


class PatchFeatures(nn.Module):
    """Feature vector of a patch and an action (paper, figure 3)."""

    n_images = 1
    """Images in a patch: the heights alone."""

    def __init__(self, config: PatchNetworkConfig, normalisation: Normalisation, n_action: int = 3):
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
        self.action = nn.Sequential(nn.Linear(n_action, config.action_width), nn.ReLU(), dropout)
        self.n_features = config.trunk_width + config.action_width
        self.mixed_precision = False
        self.action_scale: Tensor
        scale = (*normalisation.action_scale, torch.pi / 2)
        self.register_buffer("action_scale", torch.tensor(scale[:n_action]), persistent=False)

    def prepare(self, patches: Tensor, height: Tensor) -> Tensor:
        """Standardise patches (n, 1, p, p) in metres above the table; the grasp's height is not used."""
        return standardise(patches)

    def forward(self, prepared: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Compute features (n, f) of prepared patches (n, 1, p, p) and object centres (n, 3), metres."""
        with image_autocast(self):
            image = self.image(self.convolutions(prepared))
        return torch.cat([image.float(), self.action(centre_grasp / self.action_scale)], dim=-1)


def make_features(
    config: NetworkConfig, normalisation: Normalisation, *, quality: bool
) -> PatchFeatures | HandFeatures:
    """Build the features of the quality or the displacement network."""
    if isinstance(config, PatchNetworkConfig):
        n_action = 4 if config.sees_object and not quality else 3
        return PatchFeatures(config, normalisation, n_action)
    if quality:
        return HandFeatures(config, normalisation, config.layers, config.quality_shape, config.blocks)
    return HandFeatures(
        config, normalisation, config.displacement_layers, config.patch_shape, config.displacement_blocks
    )


def _head(n_features: int, config: NetworkConfig, n_outputs: int) -> nn.Sequential:
    hidden = nn.Linear(n_features, config.head_width)
    return nn.Sequential(
        hidden, nn.ReLU(), nn.Dropout(config.dropout), nn.Linear(config.head_width, n_outputs)
    )


class GraspQualityNetwork(nn.Module):
    """GQN: the probability that a grasp lifts the part (paper, section 3.4)."""

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        self.features = make_features(config, normalisation, quality=True)
        self.head = _head(self.features.n_features, config, 2)
        log_odds = math.log(normalisation.base_rate / (1 - normalisation.base_rate))
        self.log_prior_odds: Tensor
        self.register_buffer("log_prior_odds", torch.tensor(log_odds), persistent=False)

    def forward(self, patches: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Logits (n, 2) of failure and success among balanced data.

        Args:
            patches: (n, 1, r, c) metres above the table, rotated with the grasps.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
            height: (n,) of the grasps above the table, metres.
        """
        return self.head(self.features(_prepared(self.features, patches, height), centre_grasp, height))

    def quality(self, logits: Tensor) -> Tensor:
        """Compute probabilities of success (n,), corrected from balanced data to the true base rate."""
        return torch.sigmoid(logits[:, 1] - logits[:, 0] + self.log_prior_odds)


class Gaussians(NamedTuple):
    """A mixture of m Gaussians of k independent components for each of n grasps, metres and radians.

    Attributes:
        mean: (n, m, k).
        variance: (n, m, k); None where the mean alone is predicted.
        log_weight: (n, m) logarithms of their shares, which sum to 1.
    """

    mean: Tensor
    variance: Tensor | None
    log_weight: Tensor


class GraspDisplacementNetwork(nn.Module):
    """GDN: a Gaussian over the grasp displacement of a successful grasp (paper, section 3.4).

    With ``swing: true`` also over the swing of the part: k = 6 components instead of 4. With ``mixture`` it
    is a mixture of m Gaussians (Bishop, Mixture Density Networks, 1994); `forward` gives mean and variance.
    """

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        self.sees_object = config.sees_object
        self.features = make_features(config, normalisation, quality=False)
        n_outputs, self.n_gaussians = config.n_outputs, config.mixture
        n_heads = n_outputs * config.mixture
        self.mean_head = _head(self.features.n_features, config, n_heads)
        self.variance_head = _head(self.features.n_features, config, n_heads) if config.variance else None
        self.weight_head = (
            _head(self.features.n_features, config, config.mixture) if config.mixture > 1 else None
        )
        self.target_mean: Tensor
        self.target_std: Tensor
        self.register_buffer("target_mean", torch.tensor(normalisation.target_mean), persistent=False)
        self.register_buffer("target_std", torch.tensor(normalisation.target_std), persistent=False)
        metres, radians = (float(np.float32(std) ** 2) for std in config.least_std)
        self.least_variance: Tensor
        floor = torch.tensor([metres, metres, metres, radians, radians, radians])[:n_outputs]
        self.register_buffer("least_variance", floor, persistent=False)

    def forward(
        self,
        patches: Tensor,
        centre_grasp: Tensor,
        height: Tensor,
        theta: Tensor | None = None,
    ) -> tuple[Tensor, Tensor | None]:
        """Mean and variance (n, k) of grasp displacement and swing, in metres and radians (squared).

        The variance is None where the network predicts the mean alone.

        Args:
            patches: (n, 1, r, c) metres above the table, rotated with the grasps.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
            height: (n,) of the grasps above the table, metres.
            theta: (n,) the grasps' angles, for ``image: object``, whose patches are not rotated.
        """
        prepared = _prepared(self.features, patches, height)
        if not self.sees_object:
            return self.outputs(self.features(prepared, centre_grasp, height))
        assert theta is not None, "image: object needs the grasps' angles"
        # The network works along the image's axes.
        centre = torch.cat([_rotated(centre_grasp, theta), theta[:, None]], dim=-1)
        mean, variance = self.outputs(self.features(prepared, centre, height))
        mean = torch.cat([_rotated(mean[:, :3], -theta), mean[:, 3:]], dim=-1)
        if variance is None:
            return mean, None
        cos, sin = theta.cos().square(), theta.sin().square()
        x, y = variance[:, 0], variance[:, 1]
        along = torch.stack([cos * x + sin * y, sin * x + cos * y], dim=-1)
        return mean, torch.cat([along, variance[:, 2:]], dim=-1)

    def outputs(self, features: Tensor) -> tuple[Tensor, Tensor | None]:
        """Compute mean and variance (n, k) from features (n, f), along the axes of the patch."""
        gaussians = self.gaussians(features)
        if self.n_gaussians == 1 or gaussians.variance is None:
            return gaussians.mean[:, 0], None if gaussians.variance is None else gaussians.variance[:, 0]
        weight = gaussians.log_weight.exp()[..., None]
        mean = (weight * gaussians.mean).sum(dim=1)
        apart = (gaussians.mean - mean[:, None]).square()
        return mean, (weight * (gaussians.variance + apart)).sum(dim=1)

    def gaussians(self, features: Tensor) -> Gaussians:
        """Compute the distribution from features (n, f), along the axes of the patch."""
        shape = len(features), self.n_gaussians, len(self.target_mean)
        mean = self.target_mean + self.target_std * self.mean_head(features).view(shape)
        if self.weight_head is None:
            log_weight = features.new_zeros(shape[:2])
        else:
            log_weight = torch.log_softmax(self.weight_head(features), dim=-1)
        if self.variance_head is None:
            return Gaussians(mean, None, log_weight)
        # The bound keeps a single outlier from driving the exponential to infinity or to zero.
        log_variance = self.variance_head(features).clamp(-_LOG_VARIANCE_LIMIT, _LOG_VARIANCE_LIMIT)
        variance = self.target_std.square() * log_variance.exp().view(shape) + self.least_variance
        return Gaussians(mean, variance, log_weight)

    def loss(
        self,
        patches: Tensor,
        centre_grasp: Tensor,
        height: Tensor,
        theta: Tensor,
        target: Tensor,
        beta: float,
    ) -> Tensor:
        """Compute `mixture_loss`, or `displacement_loss` of a single Gaussian, which beta belongs to."""
        if self.n_gaussians == 1:
            mean, variance = self(patches, centre_grasp, height, theta)
            return displacement_loss(mean, variance, target, self.target_std, beta=beta)
        features = self.features(_prepared(self.features, patches, height), centre_grasp, height)
        return mixture_loss(self.gaussians(features), target, self.target_std)

    def start_from(self, gqn: GraspQualityNetwork) -> None:
        """Copy the convolutions' weights of a trained GQN (paper, figure 3)."""
        if self.sees_object:
            return  # another input: the paper initialises these at random
        if isinstance(self.features, HandFeatures):
            return  # its layers and resolution differ
        self.features.convolutions.load_state_dict(gqn.features.convolutions.state_dict())


def _prepared(features: PatchFeatures | HandFeatures, patches: Tensor, height: Tensor) -> Tensor:
    prepared = features.prepare(patches, height)
    if isinstance(features, HandFeatures):
        return prepared
    # Measured on a CPU: channels last makes these convolutions about 40 % faster.
    return prepared.contiguous(memory_format=torch.channels_last)


def _rotated(vectors: Tensor, angle: Tensor) -> Tensor:
    """Rotate vectors (n, 3) about z by angles (n,)."""
    cos, sin = angle.cos(), angle.sin()
    x, y = vectors[:, 0], vectors[:, 1]
    return torch.stack([cos * x - sin * y, sin * x + cos * y, vectors[:, 2]], dim=-1)


def displacement_error(mean: Tensor, target: Tensor) -> Tensor:
    """Compute target minus mean (n, k), angles wrapped."""
    error = target - mean
    return torch.cat([error[..., :3], wrap_angle(error[..., 3:])], dim=-1)


def displacement_loss(
    mean: Tensor, variance: Tensor | None, target: Tensor, target_std: Tensor, *, beta: float = 0.0
) -> Tensor:
    """Compute equation 5 of the paper: sum of log variance + squared error / variance, batch mean.

    Both are in normalised units, which adds a constant: a loss near k means "no better than the training
    mean". Without variances it is the squared error.

    Args:
        mean: (n, k) predicted grasp displacement and, with k = 6, swing.
        variance: (n, k) or None.
        target: (n, k).
        target_std: (k,) the training data's deviation.
        beta: 0 is the paper's loss; 0.5 weights each term by the square root of its variance, which fits
            the mean better where the variance is large (Seitzer et al. 2022, arXiv 2203.09168).
    """
    squared = (displacement_error(mean, target) / target_std).square()
    if variance is None:
        return squared.sum(dim=-1).mean()
    variance = variance / target_std.square()
    terms = variance.log() + squared / variance
    if beta > 0:
        terms = terms * variance.detach().pow(beta)
    return terms.sum(dim=-1).mean()


def mixture_loss(gaussians: Gaussians, target: Tensor, target_std: Tensor) -> Tensor:
    """Compute the negative log likelihood of a mixture in the scale of `displacement_loss`, batch mean.

    Of a single Gaussian it equals that loss without beta.

    Args:
        gaussians: Predicted, with variances.
        target: (n, k).
        target_std: (k,) the training data's deviation.
    """
    assert gaussians.variance is not None
    squared = (displacement_error(gaussians.mean, target[:, None]) / target_std).square()
    variance = gaussians.variance / target_std.square()
    terms = (variance.log() + squared / variance).sum(dim=-1)
    return -2 * torch.logsumexp(gaussians.log_weight - terms / 2, dim=-1).mean()
