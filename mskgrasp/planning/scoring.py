"""Predictions of the networks for many grasps in one image: the planner's inner loop.

Grasps are arrays (n, 4) here, x y z theta in the base frame: `mskgrasp.core.grasp.Grasp.as_vector`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PartView, centre_in_grasp_frame
from mskgrasp.learning.grasp_models import Models
from mskgrasp.learning.network_config import NetworkConfig
from mskgrasp.learning.symmetry import N_VIEWS
from mskgrasp.perception.height_patches import crop_patches, height_image
from mskgrasp.planning.parallel import map_batches

_BATCHES = 4
"""Batches that grasps are shared out among, whatever the number of cores: rounding depends on their sizes."""
_FEWEST = 2
"""Batches of however few grasps: with a single one the other cores wait."""
_ON_A_GPU = 8192
"""Most grasps in a batch on a GPU: its kernels take longer to start than to run."""
_SMALL = 48
"""Views of grasps in a batch; fewer cost more time for each."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Height image in which grasps are scored.

    Attributes:
        heights: (h, w) metres above the table, on the networks' device.
        intrinsics: (3, 3).
        T_base_camera: Pose of the camera.
        table_z: Height of the table, base frame, metres.
        view: The detected part.
    """

    heights: Tensor
    intrinsics: np.ndarray
    T_base_camera: Pose
    table_z: float
    view: PartView

    @classmethod
    def of(cls, frame: RgbdFrame, view: PartView, table_z: float, device: torch.device) -> Scene:
        """Make the scene of a frame; depth that is not finite is invalid."""
        known = np.asarray(frame.depth, dtype=np.float32)
        depth = torch.as_tensor(np.where(np.isfinite(known), known, np.float32(np.nan)), device=device)
        return cls(
            heights=height_image(depth, frame.intrinsics, frame.T_base_camera, table_z + view.table_offset),
            intrinsics=frame.intrinsics,
            T_base_camera=frame.T_base_camera,
            table_z=table_z,
            view=view,
        )

    def crop(self, grasps: np.ndarray, network: NetworkConfig) -> Tensor:
        """Crop patches (n, 1, r, c) around grasps (n, 4) for the displacement network."""
        return self.crop_of(grasps, network.patch_shape, network.pixel)

    def crop_for_quality(self, grasps: np.ndarray, network: NetworkConfig) -> Tensor:
        """Crop patches (n, 1, r, c) around grasps (n, 4) for the quality network, at its resolution."""
        return self.crop_of(grasps, network.quality_shape, network.pixel * network.quality_stride)

    def crop_of(self, grasps: np.ndarray, shape: tuple[int, int], pixel: float) -> Tensor:
        """Crop patches of any shape and pixel distance, metres: `height_patches.crop_patches`."""
        return crop_patches(
            self.heights,
            torch.as_tensor(grasps),
            self.intrinsics,
            self.T_base_camera,
            n_pixels=shape[0],
            side=shape[0] * pixel,
            n_columns=shape[1],
        )


def qualities(models: Models, scene: Scene, grasps: np.ndarray, chunk: int) -> np.ndarray:
    """Predict probabilities of success (n,) of grasps (n, 4)."""
    network = models.meta.network

    def predict(batch: _Batch) -> Tensor:
        patches = scene.crop_for_quality(grasps[batch.rows], network)
        return models.quality(patches, batch.centre_grasp, batch.height)

    found = map_batches(predict, _batches(models, scene, grasps, chunk), models.device)
    return torch.cat(found).cpu().double().numpy() if found else np.zeros(0)


def displacements(
    models: Models, scene: Scene, grasps: np.ndarray, chunk: int, *, all_views: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Predict mean and variance (n, k) of the grasps' displacement and, with k = 6, swing.

    Without a variance it is NaN.

    Args:
        models: The networks.
        scene: The height image.
        grasps: (n, 4).
        chunk: Greatest number of grasps in a batch.
        all_views: As in `Models.grasp_displacement`.
    """
    network = models.meta.network
    whole = None
    if network.sees_object:
        whole = scene.crop(np.append(scene.view.centre_base, 0.0)[None], network)

    def predict(batch: _Batch) -> tuple[Tensor, Tensor]:
        if whole is None:
            patches = scene.crop(grasps[batch.rows], network)
        else:
            patches = whole.expand(len(batch.theta), -1, -1, -1)
        mean, variance = models.grasp_displacement(
            patches, batch.centre_grasp, batch.height, batch.theta, all_views=all_views
        )
        return mean, torch.full_like(mean, torch.nan) if variance is None else variance

    small = _SMALL // N_VIEWS if network.symmetric_views and all_views else _SMALL
    found = map_batches(predict, _batches(models, scene, grasps, chunk, small), models.device)
    if not found:
        return np.zeros((0, network.n_outputs)), np.zeros((0, network.n_outputs))
    mean, variance = (torch.cat(values).cpu().double().numpy() for values in zip(*found, strict=True))
    return mean, variance


class _Batch(NamedTuple):
    """Some of the grasps, on the networks' device.

    Attributes:
        rows: Of the grasps.
        centre_grasp: (k, 3) object centres in the grasp frame, metres.
        height: (k,) of the grasps above the table, metres.
        theta: (k,) their angles.
    """

    rows: slice
    centre_grasp: Tensor
    height: Tensor
    theta: Tensor


def _batches(
    models: Models, scene: Scene, grasps: np.ndarray, size: int, small: int = _SMALL
) -> Iterator[_Batch]:
    """Generate equal batches of at most ``size`` grasps: `_BATCHES`, or fewer where they would be small.

    On a GPU they are as large as possible.
    """
    values = np.column_stack(
        [centre_in_grasp_frame(scene.view.centre_base, grasps), grasps[:, 2] - scene.table_z, grasps[:, 3]]
    )
    known = torch.as_tensor(values, dtype=torch.float32, device=models.device)
    if models.device.type == "cuda":
        size = _ON_A_GPU
    else:
        n_batches = max(_FEWEST, min(_BATCHES, len(grasps) // small), -(-len(grasps) // size))
        size = max(1, -(-len(grasps) // n_batches))
    for start in range(0, len(grasps), size):
        rows = slice(start, start + size)
        yield _Batch(rows, known[rows, :3], known[rows, 3], known[rows, 4])
