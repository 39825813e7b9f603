"""Height images above the table, and patches cropped from them around grasps."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from mskgrasp.core.geometry import Array, Pose, quat_to_matrix


def height_image(
    depth: Array, intrinsics: np.ndarray, T_base_camera: Pose, table_z: float | np.ndarray
) -> Array:
    """Compute the heights above the table of every pixel of depth images.

    Args:
        depth: (..., h, w) numpy array or tensor, metres along the optical axis, NaN where invalid.
        intrinsics: (..., 3, 3) pinhole matrices; pixel centres lie at integer coordinates.
        T_base_camera: Pose of the camera's optical frame in the base, one or one an image.
        table_z: Height of the table, base frame, metres, one or one an image.

    Returns:
        (..., h, w) of the kind of ``depth``, metres, NaN where the depth is invalid.
    """
    camera_z = quat_to_matrix(np.asarray(T_base_camera.quat_wxyz, dtype=np.float64))[..., 2, :]
    inverse = np.linalg.inv(np.asarray(intrinsics, dtype=np.float64))
    # The rise of a ray of depth 1, z . inv(K) (u, v, 1), is linear in the pixel.
    slope = _as_kind((camera_z[..., None, :] @ inverse)[..., 0, :], depth)
    offset = _as_kind(np.asarray(T_base_camera.position)[..., 2] - table_z, depth)
    rows, columns = _as_kind(np.arange(depth.shape[-2]), depth), _as_kind(np.arange(depth.shape[-1]), depth)
    rising = slope[..., None, None, 0] * columns + slope[..., None, None, 1] * rows[:, None]
    return depth * (rising + slope[..., None, None, 2]) + offset[..., None, None]


def _as_kind(values: np.ndarray, like: Array) -> Array:
    if isinstance(like, torch.Tensor):
        return torch.as_tensor(values, dtype=like.dtype, device=like.device)
    return np.asarray(values, dtype=like.dtype)


def crop_patches(
    heights: Tensor,
    grasps: Tensor,
    intrinsics: Array,
    T_base_camera: Pose,
    *,
    n_pixels: int = 64,
    side: float = 0.128,
    n_columns: int | None = None,
) -> Tensor:
    """Crop the height image around grasps, rotated so that the fingers close along the columns.

    A patch is a rectangle of the horizontal plane through the grasp point, centred on it: the grasp frame's
    x points right, its y, the closing direction, up. It is sampled bilinearly. Invalid pixels do not
    spread: they are excluded from the interpolation; where they prevail, and outside the image, the table (0)
    is assumed.

    Args:
        heights: (h, w) one image for all grasps, or (n, h, w) one image each; metres above the table,
            NaN where invalid.
        grasps: (n, 4) base frame, metres and radians.
        intrinsics: (3, 3) or (n, 3, 3).
        T_base_camera: One pose or n poses.
        n_pixels: Pixels along the closing direction.
        side: Length along it, metres.
        n_columns: Pixels across it, as far apart; None: as many.

    Returns:
        (n, 1, n_pixels, n_columns) float32 on the device of ``heights``, metres above the table.
    """
    height, width = heights.shape[-2:]
    n_columns = n_columns or n_pixels
    # Computed where the grasps are: starting a GPU's kernels takes longer than these few numbers.
    axes = _patch_axes(grasps, intrinsics, T_base_camera).to(heights.device)
    along, across = (
        (torch.arange(n, device=heights.device, dtype=torch.float32) - (n - 1) / 2) * (side / n_pixels)
        for n in (n_pixels, n_columns)
    )
    up, right = (values.flatten() for values in torch.meshgrid(-along, across, indexing="ij"))
    points = torch.stack([torch.ones_like(up), right, up])
    distance = axes[..., 2] @ points
    if distance.numel() and float(distance.min()) < 1e-6:
        distance.clamp_(min=1e-6)  # points behind the camera project far outside
    where = torch.empty(
        2, *distance.shape, device=heights.device
    )  # written and searched faster than (..., 2)
    for k, size in enumerate((width, height)):
        # To grid_sample's units before the division by the distance: (2 / (width - 1)) u - 1.
        unit = axes[..., k] * (2 / (size - 1)) - axes[..., 2]
        torch.div(unit @ points, distance, out=where[k])
    return _sampled(heights, where).reshape(-1, 1, n_pixels, n_columns)


def _sampled(heights: Tensor, where: Tensor) -> Tensor:
    """Interpolate heights (a, b) of one image (h, w), or of a images (a, h, w), at (2, a, b)."""
    one = heights.ndim == 2
    images = heights[None, None] if one else heights[:, None]
    points = where.permute(1, 2, 0)
    grid = points[None] if one else points[:, None]
    valid = ~torch.isnan(images)
    if bool(valid.all()):
        value = torch.nn.functional.grid_sample(
            images.float(), grid, mode="bilinear", padding_mode="border", align_corners=True
        )
        value = value.reshape(where.shape[1:])
        if not where.numel() or max(map(abs, map(float, where.aminmax()))) <= 1.0:
            return value  # all within the image
        # The share of the four pixels around a point that lies within the image, as below.
        share = torch.ones_like(value)
        for k, size in enumerate((heights.shape[-1], heights.shape[-2])):
            beyond = where[k].abs().sub_(1).clamp_(min=0)
            share *= (1 - beyond.mul_((size - 1) / 2)).clamp_(min=0)
        return value.masked_fill_(share < 0.5, 0.0)
    source = torch.cat([torch.where(valid, images, 0.0), valid.to(images.dtype)], dim=1).float()
    sampled = torch.nn.functional.grid_sample(
        source, grid, mode="bilinear", padding_mode="zeros", align_corners=True
    )
    value, weight = (sampled[:, k].reshape(where.shape[1:]) for k in (0, 1))
    return torch.where(weight >= 0.5, value / weight.clamp(min=0.5), 0.0)


def _patch_axes(grasps: Tensor, intrinsics: Array, T_base_camera: Pose) -> Tensor:
    """Compute homogeneous pixels (n, 3, 3) of the grasp points and of unit steps along their x and y."""
    device = grasps.device
    grasps = grasps.double()
    matrix = torch.as_tensor(intrinsics, dtype=torch.float64, device=device)
    position = torch.as_tensor(T_base_camera.position, dtype=torch.float64, device=device)
    quat_wxyz = torch.as_tensor(T_base_camera.quat_wxyz, dtype=torch.float64, device=device)
    to_image = matrix @ quat_to_matrix(quat_wxyz).mT
    cos, sin, zero = torch.cos(grasps[:, 3]), torch.sin(grasps[:, 3]), torch.zeros_like(grasps[:, 3])
    x, y = torch.stack([cos, sin, zero], dim=-1), torch.stack([-sin, cos, zero], dim=-1)
    vectors_base = torch.stack([grasps[:, :3] - position, x, y], dim=-2)
    return (vectors_base @ to_image.mT).float()
