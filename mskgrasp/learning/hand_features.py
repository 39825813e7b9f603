"""Features of a grasp from the heights around it, relative to the finger tips, the pads and the palm.

The paper's network standardises each patch by its own mean and deviation: the part's height relative to the
fingers is lost, and can only be inferred from the grasp's distance to the part's centre. Here every pixel
says whether the surface reaches the finger tips and the palm. A coarse image and a small network suffice.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mskgrasp.core.grasp import PAD_REACH, PALM_HEIGHT
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation

_EDGE = 0.005
"""Half the width of the ramp between below and above, metres: a depth camera is no sharper."""

_NEAR = 0.03
_HIGH = 0.05
"""Heights that are scaled to 1, metres: relative to the TCP, and above the table."""


def image_autocast(features: nn.Module) -> torch.autocast:
    """Autocast for the image branch of features that train in mixed precision; they predict in float32."""
    return torch.autocast(
        next(features.parameters()).device.type,
        dtype=torch.bfloat16,
        enabled=bool(features.mixed_precision and features.training),
    )


class ResidualBlock(nn.Module):
    """Two convolutions whose output is added to their input (He et al. 2016, arXiv 1512.03385)."""

    def __init__(self, channels: int):
        super().__init__()
        self.first = nn.Conv2d(channels, channels, 3, padding=1)
        self.second = nn.Conv2d(channels, channels, 3, padding=1)
        # At first the block changes nothing: without normalisation layers a deep network learns from there.
        for parameter in self.second.parameters():
            nn.init.zeros_(parameter)

    def forward(self, image: Tensor) -> Tensor:
        """Compute features (n, c, r, w) of an image of the same shape."""
        return torch.relu(image + self.second(torch.relu(self.first(image))))


class HandFeatures(nn.Module):
    """Feature vector of the heights around a grasp and the part's centre relative to it."""

    n_images = 1
    """Images in a patch: the heights alone."""

    def __init__(
        self,
        config: HandNetworkConfig,
        normalisation: Normalisation,
        widths: tuple[int, ...],
        shape: tuple[int, int],
        blocks: tuple[int, ...] = (),
    ):
        """Build the layers.

        Args:
            config: Widths.
            normalisation: Scale of the object centre.
            widths: Channels of the convolutions.
            shape: Rows and columns of the patches.
            blocks: Numbers of residual blocks after each convolution; empty: none.
        """
        super().__init__()
        layers: list[nn.Module] = []
        before = self.n_channels = 4
        rows, columns = shape
        for number, (width, n_blocks) in enumerate(zip(widths, blocks or [0] * len(widths), strict=True)):
            kernel = 5 if number == 0 else 3
            layers += [nn.Conv2d(before, width, kernel, stride=2, padding=kernel // 2), nn.ReLU(inplace=True)]
            layers += [ResidualBlock(width) for _ in range(n_blocks)]
            before, rows, columns = width, (rows + 1) // 2, (columns + 1) // 2
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        n_flat = before * rows * columns
        self.image = nn.Sequential(nn.Linear(n_flat, config.trunk_width), nn.ReLU(inplace=True))
        self.action = nn.Sequential(nn.Linear(4, config.action_width), nn.ReLU(inplace=True))
        self.n_features = config.trunk_width + config.action_width
        self.mixed_precision = False
        # By numpy: torch needs a second to load what it computes with where tensors are shapes alone.
        scale = np.float32(1) / np.array([_EDGE, _NEAR, _EDGE, _HIGH], dtype=np.float32)
        self.channel_scale: Tensor
        self.register_buffer("channel_scale", torch.tensor(scale.tolist())[:, None, None], persistent=False)
        self.action_scale: Tensor
        self.register_buffer("action_scale", torch.tensor(normalisation.action_scale), persistent=False)

    def prepare(self, patches: Tensor, height: Tensor) -> Tensor:
        """Compute the network's input channels from patches (n, 1, r, c) in metres above the table.

        Args:
            patches: Centred on the grasps and rotated with them.
            height: (n,) of the grasps' TCP above the table, metres.

        Returns:
            (n, 4, r, c): reaches the finger tips, height relative to the TCP, reaches the palm, height above
            the table.
        """
        n, _, rows, columns = patches.shape
        surface, grasp = patches[:, 0], height[:, None, None]
        prepared = patches.new_empty(n, self.n_channels, rows, columns)
        # In place: this is limited by memory bandwidth, not by arithmetic.
        for channel, (zero, low, high) in enumerate(
            (
                (grasp - PAD_REACH, -_EDGE, _EDGE),
                (grasp, -2 * _NEAR, 2 * _NEAR),
                (grasp + PALM_HEIGHT, -_EDGE, _EDGE),
            )
        ):
            torch.sub(surface, zero, out=prepared[:, channel]).clamp_(low, high)
        torch.clamp(surface, -_HIGH, 4 * _HIGH, out=prepared[:, 3])
        return prepared.mul_(self.channel_scale)

    def forward(self, prepared: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Compute features (n, f) of prepared patches, object centres (n, 3) and heights (n,), metres."""
        action = torch.cat([centre_grasp / self.action_scale, height[:, None] / _HIGH], dim=-1)
        with image_autocast(self):
            image = self.image(self.convolutions(prepared))
        return torch.cat([image.float(), self.action(action)], dim=-1)
