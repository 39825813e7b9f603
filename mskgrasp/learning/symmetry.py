"""Symmetries of a parallel jaw: half a turn about its approach direction, and mirroring.

After half a turn the fingers close on the same places; a part mirrored along the closing direction moves as
the mirror image of the part.
"""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor

N_VIEWS = 4
"""Number of views that `views` generates."""


def mirror_and_turn(
    patches: Tensor, centre_grasp: Tensor, target: Tensor, generator: torch.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Rotate a random half of the samples by half a turn, and mirror a random half of them.

    Args:
        patches: (n, 1, r, c).
        centre_grasp: (n, 3), grasp frame.
        target: (n, k) displacement, k = 4, or 6 with the swing, grasp frame.
        generator: On the device of the patches.
    """
    turn, mirror = torch.rand((2, len(patches)), generator=generator, device=patches.device) < 0.5
    patches = torch.where(turn[:, None, None, None], patches.flip(-1, -2), patches)
    patches = torch.where(mirror[:, None, None, None], patches.flip(-2), patches)
    signs = _signs(torch.where(turn, -1.0, 1.0), torch.where(mirror, -1.0, 1.0))
    return patches, centre_grasp * signs[:, :3], target * signs[:, : target.shape[1]]


def views(patches: Tensor, centre_grasp: Tensor) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Generate the four equivalent views of grasps: original, mirrored, rotated by half a turn, and both.

    Yields:
        Patches (n, 1, r, c), centres (n, 3), and the signs (6,) that convert displacement and swing predicted
        for the view into the grasp's, and back.
    """
    for turn in (1.0, -1.0):
        for mirror in (1.0, -1.0):
            signs = _signs(patches.new_tensor(turn), patches.new_tensor(mirror))
            flipped = [axis for axis, sign in ((-1, turn), (-2, turn * mirror)) if sign < 0]
            yield patches.flip(flipped) if flipped else patches, centre_grasp * signs[:3], signs


def _signs(turned: Tensor, mirrored: Tensor) -> Tensor:
    """Compute the signs (..., 6) of x, y, z, theta and the swing about x and y under turn and mirroring.

    A rotation vector is mirrored with the opposite sign: along y, its x and z change theirs.
    """
    one = torch.ones_like(turned)
    return torch.stack([turned, turned * mirrored, one, mirrored, turned * mirrored, turned], dim=-1)
