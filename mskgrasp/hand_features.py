"""Features of a grasp from what the parts of the hand would meet there.

The paper's network sees heights that each picture's own mean and deviation have been taken from: how high a
part stands against the fingers is lost, and has to be guessed from the grasp's distance to the part's centre.
Here every pixel says whether what stands there reaches up to the finger tips and up to the palm. Then a
coarse picture of the hand's surroundings and a small network tell more than a fine one of the world.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mskgrasp.grasp import PAD_REACH
from mskgrasp.network_config import NetworkConfig, Normalisation

PALM = 0.037
"""How far the palm is above the TCP, metres (collision mesh of the Panda hand)."""

_EDGE = 0.005
"""Metres above and below within which a height counts in part: a depth camera is no sharper."""

_NEAR = 0.03
_HIGH = 0.05
"""Metres that the networks see as one: along the pads, and over the table."""


class HandFeatures(nn.Module):
    """What is around a grasp, and where the part's centre lies from it, as one vector."""

    def __init__(
        self,
        config: NetworkConfig,
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
            layers += [nn.Conv2d(before, width, kernel, stride=2, padding=kernel // 2), nn.ReLU()]
            before = width
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        with torch.no_grad():
            n_read = self.convolutions(torch.zeros(1, self.n_channels, *shape)).shape[1]
        self.image = nn.Sequential(nn.Linear(n_read, config.trunk_width), nn.ReLU())
        self.action = nn.Sequential(nn.Linear(4, config.action_width), nn.ReLU())
        self.n_features = config.trunk_width + config.action_width
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
        beside = patches - height[:, None, None, None]
        return torch.cat(
            [
                ((beside + PAD_REACH) / _EDGE).clamp(-1, 1),
                (beside / _NEAR).clamp(-2, 2),
                ((beside - PALM) / _EDGE).clamp(-1, 1),
                (patches / _HIGH).clamp(-1, 4),
            ],
            dim=1,
        )

    def forward(self, prepared: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Features (n, f) of prepared patches, object centres (n, 3) and heights (n,), metres."""
        action = torch.cat([centre_grasp / self.action_scale, height[:, None] / _HIGH], dim=-1)
        return torch.cat([self.image(self.convolutions(prepared)), self.action(action)], dim=-1)
