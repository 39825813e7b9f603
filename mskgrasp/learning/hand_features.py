"""Features of a grasp from what the parts of the hand would meet there.

The paper's network sees heights that each picture's own mean and deviation have been taken from: how high a
part stands against the fingers is lost, and has to be guessed from the grasp's distance to the part's centre.
Here every pixel says whether what stands there reaches up to the finger tips and up to the palm. Then a
coarse picture of the hand's surroundings and a small network tell more than a fine one of the world.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mskgrasp.core.grasp import PAD_REACH, PALM_HEIGHT
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation

_EDGE = 0.005
"""Metres above and below within which a height counts in part: a depth camera is no sharper."""

_NEAR = 0.03
_HIGH = 0.05
"""Metres that the networks see as one: along the pads, and over the table."""


def learning_in_bfloat16(features: nn.Module) -> torch.autocast:
    """Where features that learn in mixed precision look at the picture; they predict in float32."""
    return torch.autocast(
        next(features.parameters()).device.type,
        dtype=torch.bfloat16,
        enabled=bool(features.mixed_precision and features.training),
    )


class HandFeatures(nn.Module):
    """What is around a grasp, and where the part's centre lies from it, as one vector."""

    def __init__(
        self,
        config: HandNetworkConfig,
        normalisation: Normalisation,
        widths: tuple[int, ...],
        shape: tuple[int, int],
    ):
        """Takes the channels of its convolutions, and the rows and columns of its patches."""
        super().__init__()
        layers: list[nn.Module] = []
        before = self.n_channels = 4
        for number, width in enumerate(widths):
            kernel = 5 if number == 0 else 3
            layers += [nn.Conv2d(before, width, kernel, stride=2, padding=kernel // 2), nn.ReLU(inplace=True)]
            before = width
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            n_read = self.convolutions(torch.zeros(1, self.n_channels, *shape)).shape[1]
        self.image = nn.Sequential(nn.Linear(n_read, config.trunk_width), nn.ReLU(inplace=True))
        self.action = nn.Sequential(nn.Linear(4, config.action_width), nn.ReLU(inplace=True))
        self.n_features = config.trunk_width + config.action_width
        self.mixed_precision = False
        scale = 1 / torch.tensor([_EDGE, _NEAR, _EDGE, _HIGH])
        self.channel_scale: Tensor
        self.register_buffer("channel_scale", scale[:, None, None], persistent=False)
        self.action_scale: Tensor
        self.register_buffer("action_scale", torch.tensor(normalisation.action_scale), persistent=False)

    def prepare(self, patches: Tensor, height: Tensor) -> Tensor:
        """What the network takes of patches (n, 1, r, c) in metres above the table.

        Args:
            patches: Of the plane through the grasps.
            height: (n,) of the grasps' TCP above the table, metres.

        Returns:
            (n, 4, r, c): reaches the finger tips, height beside the pads, reaches the palm, height over the
            table.
        """
        n, _, rows, columns = patches.shape
        seen, grasp = patches[:, 0], height[:, None, None]
        prepared = patches.new_empty(n, self.n_channels, rows, columns)
        # In place: the memory's speed decides how long this takes, not the sums.
        for channel, (zero, low, high) in enumerate(
            (
                (grasp - PAD_REACH, -_EDGE, _EDGE),
                (grasp, -2 * _NEAR, 2 * _NEAR),
                (grasp + PALM_HEIGHT, -_EDGE, _EDGE),
            )
        ):
            torch.sub(seen, zero, out=prepared[:, channel]).clamp_(low, high)
        torch.clamp(seen, -_HIGH, 4 * _HIGH, out=prepared[:, 3])
        return prepared.mul_(self.channel_scale)

    def forward(self, prepared: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Features (n, f) of prepared patches, object centres (n, 3) and heights (n,), metres."""
        action = torch.cat([centre_grasp / self.action_scale, height[:, None] / _HIGH], dim=-1)
        with learning_in_bfloat16(self):
            image = self.image(self.convolutions(prepared))
        return torch.cat([image.float(), self.action(action)], dim=-1)
