"""What the networks say of many grasps in one image, sharing between them what can be shared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hal.camera import RgbdFrame
from mskgrasp.field import STRIDE
from mskgrasp.geometry import Pose
from mskgrasp.grasp import PartView, centre_in_grasp_frame
from mskgrasp.images import crop_patches, height_image
from mskgrasp.models import Models
from mskgrasp.network_config import patch_plane

_MARGIN = 0.016
"""Metres around the outermost points that are read, which the convolutions see."""

LEAST_SHARING = 4
"""Grasps of one angle from which on a turned map costs less than a patch for each."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """An image in which grasps are looked at.

    Attributes:
        heights: (h, w) metres above the table, on the networks' device.
        intrinsics: (3, 3).
        T_base_camera: Pose of the camera.
        view: The part in it.
    """

    heights: Tensor
    intrinsics: np.ndarray
    T_base_camera: Pose
    view: PartView

    @classmethod
    def of(cls, frame: RgbdFrame, view: PartView, table_z: float, device: torch.device) -> Scene:
        """The scene of a frame."""
        depth = torch.as_tensor(np.asarray(frame.depth, dtype=np.float32), device=device)
        heights = height_image(depth, frame.intrinsics, frame.T_base_camera, table_z)
        return cls(heights=heights, intrinsics=frame.intrinsics, T_base_camera=frame.T_base_camera, view=view)

    def crop(self, grasps: np.ndarray, n_pixels: int, side: float) -> Tensor:
        """Patches (n, 1, n_pixels, n_pixels) around grasps (n, 4)."""
        return crop_patches(
            self.heights,
            torch.as_tensor(grasps),
            self.intrinsics,
            self.T_base_camera,
            n_pixels=n_pixels,
            side=side,
        )


def qualities(models: Models, scene: Scene, grasps: np.ndarray, chunk: int) -> np.ndarray:
    """Predicted probabilities of success (n,) of grasps (n, 4)."""
    angles, of_angle = np.unique(grasps[:, 3], return_inverse=True)
    if models.meta.network.architecture == "field" and len(grasps) >= LEAST_SHARING * len(angles):
        return _shared_qualities(models, scene, grasps, angles, of_angle)
    pieces = [models.quality(*inputs) for inputs in _patches(models, scene, grasps, chunk)]
    return torch.cat(pieces).cpu().double().numpy()


def displacements(
    models: Models, scene: Scene, grasps: np.ndarray, chunk: int
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (n, 4) of the grasps' displacement; NaN variance where the model knows none."""
    means, variances = [], []
    for patches, centres, theta in _displacement_inputs(models, scene, grasps, chunk):
        mean, variance = models.grasp_displacement(patches, centres, theta)
        means.append(mean)
        variances.append(torch.full_like(mean, torch.nan) if variance is None else variance)
    return torch.cat(means).cpu().double().numpy(), torch.cat(variances).cpu().double().numpy()


def _displacement_inputs(
    models: Models, scene: Scene, grasps: np.ndarray, chunk: int
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Patches, object centres and angles for the displacement network, a chunk at a time."""
    network = models.meta.network
    angles = torch.as_tensor(grasps[:, 3], dtype=torch.float32, device=models.device)
    chunks = zip(_patches(models, scene, grasps, chunk), angles.split(chunk), strict=True)
    if network.image == "grasp":
        yield from ((*inputs, theta) for inputs, theta in chunks)
        return
    around = np.append(scene.view.centre_base, 0.0)[None]
    patch = scene.crop(around, network.patch_pixels, network.patch_side)
    for (_, centres), theta in chunks:
        yield patch.expand(len(theta), -1, -1, -1), centres, theta


def _patches(models: Models, scene: Scene, grasps: np.ndarray, chunk: int) -> Iterator[tuple[Tensor, Tensor]]:
    """Patches (k, 1, p, p) and object centres (k, 3) of the grasps, a chunk at a time."""
    network = models.meta.network
    centres = centre_in_grasp_frame(scene.view.centre_base, grasps)
    planes = patch_plane(network, grasps, scene.view.centre_base)
    for start in range(0, len(grasps), chunk):
        rows = slice(start, start + chunk)
        patches = scene.crop(planes[rows], network.patch_pixels, network.patch_side)
        yield patches, torch.as_tensor(centres[rows], dtype=torch.float32, device=patches.device)


def _shared_qualities(
    models: Models, scene: Scene, grasps: np.ndarray, angles: np.ndarray, of_angle: np.ndarray
) -> np.ndarray:
    network = models.meta.network
    pixel = network.patch_side / network.patch_pixels
    centre = scene.view.centre_base
    points = _in_turned_frame(grasps, centre)
    reach = np.abs(points).max() + (max(network.grid) - 1) / 2 * network.grid_step + _MARGIN
    # In steps of two cells: the middle then lies between cells as it does in a patch.
    n_pixels = int(np.ceil(2 * reach / pixel / (2 * STRIDE))) * 2 * STRIDE
    middles = np.column_stack([np.tile(centre, (len(angles), 1)), angles])
    maps = scene.crop(middles, n_pixels, n_pixels * pixel)

    # Angles have unlike numbers of grasps: rows are filled up with the map's middle.
    order = np.argsort(of_angle, kind="stable")
    counts = np.bincount(of_angle, minlength=len(angles))
    column = np.arange(len(grasps)) - np.repeat(np.cumsum(counts) - counts, counts)
    row = of_angle[order]
    where = np.zeros((len(angles), int(counts.max()), 2), dtype=np.float32)
    centres = np.zeros((len(angles), int(counts.max()), 3), dtype=np.float32)
    where[row, column] = points[order]
    centres[row, column] = centre_in_grasp_frame(centre, grasps[order])
    found = models.shared_quality(
        maps, *(torch.as_tensor(array, device=maps.device) for array in (where, centres))
    )
    qualities = np.empty(len(grasps))
    qualities[order] = found.cpu().double().numpy()[row, column]
    return qualities


def _in_turned_frame(grasps: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Grasp points (n, 2) from the centre, along the axes of the grasps."""
    away = grasps[:, :2] - centre[:2]
    cos, sin = np.cos(grasps[:, 3]), np.sin(grasps[:, 3])
    return np.stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]], axis=-1)
