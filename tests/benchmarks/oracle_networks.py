"""Displacement networks that are given what no camera sees: more images, and numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor, nn

from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models
from mskgrasp.learning.hand_features import HandFeatures
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation
from mskgrasp.learning.samples import HEIGHT_STEP, Samples

_NEAR = 0.03
"""Height relative to the grasp that is scaled to 1, metres."""


@dataclass(frozen=True, kw_only=True)
class OracleSamples(Samples):
    """Samples with more images and numbers for the displacement network.

    Attributes:
        more_images: (n, k, r, c) int16, 0.1 mm: the underside and the sides (`oracle_images`), or k = 0.
        point: (n, 3) float32 a point in the grasp frame, metres; None: not given.
        numbers: (n, m) float32 what turning and mirroring the hand does not change, of unit scale.
    """

    more_images: Tensor
    point: Tensor | None
    numbers: Tensor

    def displacement_patches_of(self, rows: Tensor, device: torch.device | str) -> Tensor:
        """Get all images (n, 1 + k + 3 + m, r, c) of some rows: point and numbers as images, too."""
        patches = torch.cat([self.patches[rows], self.more_images[rows]], dim=1).to(device) * HEIGHT_STEP
        point = self.point[rows] if self.point is not None else self.numbers.new_zeros((len(rows), 0))
        known = torch.cat([point, self.numbers[rows]], dim=1).to(device)
        return torch.cat([patches, number_images(known, patches.shape[-2:], self.point is not None)], dim=1)


def number_images(known: Tensor, shape: torch.Size | tuple[int, ...], has_point: bool) -> Tensor:
    """Images (n, m, r, c) of numbers (n, m), from which `read_numbers` gets them after any flip.

    Of a point, x is written with its sign into the right half and with the other sign into the left, y
    likewise into the upper and the lower half: a flip of the image mirrors the point.
    """
    rows, columns = shape
    images = known[:, :, None, None].repeat(1, 1, rows, columns)
    if has_point:
        images[:, 0, :, : columns // 2] *= -1
        images[:, 1, (rows + 1) // 2 :, :] *= -1
    return images


def read_numbers(images: Tensor) -> Tensor:
    """Read numbers (n, m) from their images (n, m, r, c): the upper right corner has all signs right."""
    return images[:, :, 0, -1]


class OracleFeatures(HandFeatures):
    """Our features, without residual blocks, with k more images and m more numbers."""

    def __init__(self, config: HandNetworkConfig, normalisation: Normalisation, n_more: int, n_numbers: int):
        super().__init__(config, normalisation, config.displacement_layers, config.patch_shape)
        self.n_more, self.n_numbers = n_more, n_numbers
        self.n_images = 1 + n_more + n_numbers
        first, action = self.convolutions[0], self.action[0]
        assert isinstance(first, nn.Conv2d) and isinstance(action, nn.Linear)
        self.convolutions[0] = nn.Conv2d(self.n_channels + n_more, first.out_channels, 5, stride=2, padding=2)
        self.action[0] = nn.Linear(action.in_features + n_numbers, action.out_features)

    def prepare(self, patches: Tensor, height: Tensor) -> Tensor:
        """Compute input channels from all images (n, 1 + k + m, r, c); the numbers' images come last."""
        prepared = [super().prepare(patches[:, :1], height)]
        if self.n_more:
            below = patches[:, 1:2] - height[:, None, None, None]
            prepared += [
                (below / _NEAR).clamp(-2.0, 2.0),
                patches[:, 2 : 1 + self.n_more] / (MAX_OPENING / 2),
            ]
        return torch.cat([*prepared, patches[:, 1 + self.n_more :]], dim=1)

    def forward(self, prepared: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Compute features as `HandFeatures`, with the numbers beside the object centre."""
        n_channels = self.n_channels + self.n_more
        image = self.image(self.convolutions(prepared[:, :n_channels]))
        numbers = read_numbers(prepared[:, n_channels:])
        scaled = torch.cat([centre_grasp / self.action_scale, height[:, None] / 0.05, numbers], dim=-1)
        return torch.cat([image, self.action(scaled)], dim=-1)


def _build(meta: ModelMeta, n_more: int, n_numbers: int) -> Models:
    models = build_models(meta)
    assert isinstance(meta.network, HandNetworkConfig)
    features = OracleFeatures(meta.network, meta.normalisation, n_more, n_numbers)
    models.gdn.features = features.to(memory_format=torch.channels_last).eval()  # pyright: ignore
    return models


def builder(n_more: int, n_numbers: int) -> Callable[[ModelMeta], Models]:
    """A function that builds networks with k more images and m more numbers."""
    return partial(_build, n_more=n_more, n_numbers=n_numbers)
