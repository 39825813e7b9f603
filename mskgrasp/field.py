"""Features that many grasps of one scene share: computed once for each angle, read off at each grasp.

The paper's network looks at a patch of its own for every grasp; 3200 candidates of one part are 3200 almost
equal pictures. Here the height map is turned to each of some angles and goes through the convolutions once
for each; a grasp of that angle reads the features at a grid of points fixed to the hand, between their cells
bilinearly. Where the cells lie from the grasp is chance; training moves its patches so that every place is
learned.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mskgrasp.network_config import NetworkConfig, Normalisation

STRIDE = 4
"""Pixels of the height map to a cell of the features."""

HEIGHT_SCALE = 0.05
"""Metres that the networks see as one: about the height of a part."""

_HEIGHT_RANGE = (-0.5, 4.0)


class FieldFeatures(nn.Module):
    """What is around a grasp, and where the part's centre lies from it, as one vector."""

    def __init__(self, config: NetworkConfig, normalisation: Normalisation):
        super().__init__()
        half, width = config.channels // 2, config.channels
        self.pixel = config.patch_side / config.patch_pixels
        self.stem = nn.Sequential(
            nn.Conv2d(1, half, 5, stride=2, padding=2),
            nn.ReLU(),
            nn.Conv2d(half, width, 3, stride=2, padding=1),
            nn.ReLU(),
        )
        self.blocks = nn.ModuleList(nn.Conv2d(width, width, 3, padding=1) for _ in range(config.blocks))
        columns, rows = config.grid
        x = (torch.arange(columns) - (columns - 1) / 2) * config.grid_step
        y = (torch.arange(rows) - (rows - 1) / 2) * config.grid_step
        points = torch.stack(torch.meshgrid(x, y, indexing="ij"), dim=-1).reshape(-1, 2)
        self.points: Tensor
        self.register_buffer("points", points, persistent=False)
        self.image = nn.Linear(width * len(points), config.trunk_width)
        self.action = nn.Linear(3, config.trunk_width)
        self.dropout = nn.Dropout(config.dropout)
        self.n_features = config.trunk_width
        self.action_scale: Tensor
        self.register_buffer("action_scale", torch.tensor(normalisation.action_scale), persistent=False)

    def prepare(self, heights: Tensor) -> Tensor:
        """Metres above the table in the networks' unit: what the height means is not normalised away."""
        return (heights / HEIGHT_SCALE).clamp(*_HEIGHT_RANGE)

    def maps(self, heights: Tensor) -> Tensor:
        """Features (m, c, h / 4, w / 4) of prepared height maps (m, 1, h, w); h and w are multiples of 4."""
        features = self.stem(heights)
        for block in self.blocks:
            features = features + torch.relu(block(features))
        return features

    def at(self, maps: Tensor, where: Tensor, centre_grasp: Tensor, size: tuple[int, int]) -> Tensor:
        """Features of grasps whose angle is that of their map.

        Args:
            maps: (m, c, h / 4, w / 4).
            where: (m, k, 2) grasp points from the middle of the map, along its x (right) and y (up), metres.
            centre_grasp: (m, k, 3) object centre in the grasp frame, metres.
            size: (h, w) of the height map, pixels.

        Returns:
            (m k, f), the grasps of the first map first.
        """
        points = where[:, :, None] + self.points  # (m, k, g, 2)
        column = points[..., 0] / self.pixel + (size[1] - 1) / 2
        row = (size[0] - 1) / 2 - points[..., 1] / self.pixel
        last = torch.tensor([maps.shape[3] - 1, maps.shape[2] - 1], device=maps.device)
        grid = torch.stack([column, row], dim=-1) * (2 / STRIDE) / last - 1
        read = nn.functional.grid_sample(maps, grid, padding_mode="border", align_corners=True)
        flat = read.permute(0, 2, 1, 3).reshape(where.shape[0] * where.shape[1], -1)
        action = (centre_grasp / self.action_scale).reshape(-1, 3)
        return self.dropout(torch.relu(self.image(flat) + self.action(action)))

    def forward(self, patches: Tensor, centre_grasp: Tensor, offset: Tensor | None = None) -> Tensor:
        """Features (n, f) of prepared patches (n, 1, p, p), each turned to its grasp.

        Args:
            patches: Around the grasps.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
            offset: (2,) of the grasps from the patches' middle, metres; None: they are in the middle.
        """
        where = patches.new_zeros(2) if offset is None else offset
        size = (patches.shape[-2], patches.shape[-1])
        return self.at(self.maps(patches), where.expand(len(patches), 1, 2), centre_grasp[:, None], size)
