"""From a depth image to what the networks see: heights, where the part lies, patches around grasps."""

from __future__ import annotations

import cv2
import numpy as np
import torch
from torch import Tensor

from mskgrasp.errors import NoPartFound
from mskgrasp.geometry import Array, Pose, quat_conjugate, quat_rotate, quat_to_matrix
from mskgrasp.grasp import PartView

REGION_MARGIN = 0.05
"""How far a part that lies in the region may reach beyond it, metres."""
MOST_RAISED = 0.4
"""Share of the region's pixels that a part may cover: 15 cm of 34 cm, squared, are 20 %."""
ALONE = 0.2
"""Share of the part's pixels from which on something else in the region is another part."""
MIN_PIXELS = 5
"""Smaller groups of pixels are specks: an M3 nut covers 6 pixels of 2.2 mm."""
_PLAUSIBLE_DEPTH = 20.0
"""Metres; a camera above a table never is that far away, but a depth in millimetres always is."""


def height_image(
    depth: Array, intrinsics: np.ndarray, T_base_camera: Pose, table_z: float | np.ndarray
) -> Array:
    """Heights above the table of every pixel of depth images.

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
    # How far a ray of depth 1 rises, z . inv(K) (u, v, 1), is linear in the pixel.
    slope = _as_kind((camera_z[..., None, :] @ inverse)[..., 0, :], depth)
    offset = _as_kind(np.asarray(T_base_camera.position)[..., 2] - table_z, depth)
    rows, columns = _as_kind(np.arange(depth.shape[-2]), depth), _as_kind(np.arange(depth.shape[-1]), depth)
    rising = slope[..., None, None, 0] * columns + slope[..., None, None, 1] * rows[:, None]
    return depth * (rising + slope[..., None, None, 2]) + offset[..., None, None]


def _as_kind(values: np.ndarray, like: Array) -> Array:
    if isinstance(like, torch.Tensor):
        return torch.as_tensor(values, dtype=like.dtype, device=like.device)
    return np.asarray(values, dtype=like.dtype)


def view_part(
    depth: Array,
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    *,
    table_z: float,
    region: tuple[float, float, float, float],
    min_height: float = 0.002,
    alone: bool = False,
) -> PartView:
    """Finds the part that lies on the table, by its height alone.

    The part is the largest connected group of pixels higher than ``min_height``. Its box lies along the
    image's axes: a side wall that is seen bounds it directly, an edge of the top half a pixel further
    out than its last pixel. Its top is the height that 2 % of its pixels exceed, so that a flying pixel
    does not raise it.

    Args:
        depth: (h, w) metres, NaN where invalid.
        intrinsics: (3, 3) pinhole matrix.
        T_base_camera: Pose of the camera's optical frame in the base; it need not look straight down.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max in which the part's centre lies, base frame, metres.
        min_height: What rises less above the table is table, metres.
        alone: Refuse a second part.

    Raises:
        NoPartFound: Nothing rises above the table there, or the image is no depth in metres.
    """
    depth = np.asarray(depth.cpu() if isinstance(depth, torch.Tensor) else depth)
    _check_depth(depth)
    x, y, z = _points_base(depth, intrinsics, T_base_camera)
    heights = z - table_z
    x_min, x_max, y_min, y_max = region
    near = (x > x_min - REGION_MARGIN) & (x < x_max + REGION_MARGIN)
    near &= (y > y_min - REGION_MARGIN) & (y < y_max + REGION_MARGIN)
    raised = near & (heights > min_height)
    if raised.sum() > MOST_RAISED * max(near.sum(), 1):
        raise NoPartFound(
            f"{raised.sum() / near.sum():.0%} of the region rise more than {min_height * 1e3:g} mm above the "
            f"table (median {np.median(heights[near]) * 1e3:.1f} mm): the table is tilted, or table_z "
            f"{table_z:g} or the camera's pose is wrong; calibrate the camera anew"
        )
    mask, n_other = _largest_component(raised)
    if mask is None:
        highest = heights[near].max() if near.any() else np.nan
        raise NoPartFound(
            f"nothing rises more than {min_height * 1e3:g} mm above the table in the region (highest point "
            f"{highest * 1e3:.1f} mm); put a part there, or check table_z {table_z:g} and the camera's pose"
        )

    if mask[[0, -1]].any() or mask[:, [0, -1]].any():
        raise NoPartFound("the part is cut off by the border of the image; move it towards the middle")
    T_base_axes = _box_axes(T_base_camera)
    cos, sin = quat_to_matrix(T_base_axes.quat_wxyz)[:2, 0]
    pitch = float(np.median(depth[mask])) / np.array([intrinsics[0][0], intrinsics[1][1]])
    around = _bounds(mask)
    x_around, y_around, mask_around = x[around], y[around], mask[around]
    along_x = _extent(cos * x_around + sin * y_around, mask_around, float(pitch[0]))
    along_y = _extent((cos * y_around - sin * x_around).T, mask_around.T, float(pitch[1]))
    top = _robust_top(heights[mask])
    middle = np.array([sum(along_x) / 2, sum(along_y) / 2, 0.0])
    centre_base = T_base_axes.apply(middle)
    if not (x_min <= centre_base[0] <= x_max and y_min <= centre_base[1] <= y_max):
        raise NoPartFound(
            f"the part lies outside the region (centre at {centre_base[0]:.3f}, {centre_base[1]:.3f}, region "
            f"x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}); move it, or clear away what else is there"
        )
    if alone and n_other > ALONE * mask.sum():
        raise NoPartFound(
            f"two things lie in the region, of {mask.sum()} and {n_other} pixels; take one away"
        )
    spread = np.stack([x[mask] - centre_base[0], y[mask] - centre_base[1]], axis=-1)
    return PartView(
        centre_base=np.array([centre_base[0], centre_base[1], table_z + top / 2]),
        T_base_box=Pose(
            position=np.array([centre_base[0], centre_base[1], table_z]), quat_wxyz=T_base_axes.quat_wxyz
        ),
        size=np.array([along_x[1] - along_x[0], along_y[1] - along_y[0], top]),
        gyration_radius=float(np.sqrt((spread**2).sum(axis=1).mean())),
        table_z=float(table_z),
    )


def _points_base(depth: np.ndarray, intrinsics: np.ndarray, T_base_camera: Pose) -> np.ndarray:
    """(3, h, w) x, y, z of what every pixel sees, base frame."""
    rotation = quat_to_matrix(np.asarray(T_base_camera.quat_wxyz, dtype=np.float64))
    # Where a ray of depth 1 ends is linear in the pixel.
    along_u, along_v, first = (rotation @ np.linalg.inv(np.asarray(intrinsics, dtype=np.float64))).T
    columns, rows = np.arange(depth.shape[1]), np.arange(depth.shape[0])[:, None]
    points = np.empty((3, *depth.shape))
    for axis in range(3):
        np.add(along_u[axis] * columns, along_v[axis] * rows + first[axis], out=points[axis])
        points[axis] *= depth
        points[axis] += T_base_camera.position[axis]
    return points


def _check_depth(depth: np.ndarray) -> None:
    valid = depth[np.isfinite(depth)] if np.issubdtype(depth.dtype, np.floating) else depth[depth > 0]
    if not valid.size:
        raise NoPartFound("the depth image has no valid pixel; check the camera, its range and its exposure")
    typical = float(np.median(valid))
    if not np.issubdtype(depth.dtype, np.floating) or typical > _PLAUSIBLE_DEPTH:
        raise NoPartFound(
            f"depth is {depth.dtype} with a median of {typical:g}, expected floating metres; "
            "convert it from millimetres first"
        )


def _largest_component(mask: np.ndarray) -> tuple[np.ndarray | None, int]:
    """The largest group of neighbouring pixels, and how many pixels the second largest has."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]  # 0 is the background
    if not len(areas) or areas.max() < MIN_PIXELS:
        return None, 0
    return labels == 1 + int(np.argmax(areas)), int(np.sort(areas)[-2]) if len(areas) > 1 else 0


def _box_axes(T_base_camera: Pose) -> Pose:
    """A frame at the base's origin, z up, x along the image's rows as seen from above."""
    right = quat_to_matrix(np.asarray(T_base_camera.quat_wxyz, dtype=np.float64))[:2, 0]
    half = np.arctan2(right[1], right[0]) / 2
    return Pose(position=np.zeros(3), quat_wxyz=np.array([np.cos(half), 0.0, 0.0, np.sin(half)]))


def _bounds(mask: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns of a mask that ends before the border, with one more on every side."""
    found = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    rows, columns = (slice(int(one[0]) - 1, int(one[-1]) + 2) for one in found)
    return rows, columns


def _extent(along: np.ndarray, mask: np.ndarray, pitch: float) -> tuple[float, float]:
    """Bounds of the masked points in a coordinate (h, w) that runs along the image's rows.

    The mask ends before the border.
    """
    bounds = []
    for sign in (-1.0, 1.0):
        outward = np.where(mask, sign * along, -np.inf)
        row, column = np.unravel_index(int(np.argmax(outward)), mask.shape)
        neighbours = outward[row, column - 1], outward[row, column + 1]
        # On a wall two neighbouring pixels have the same coordinate: its place is known exactly. On a
        # flat top they are a pixel apart, and the edge is, on average, half of that further out.
        step = outward[row, column] - max(neighbours)
        bounds.append(sign * float(outward[row, column] + min(step, pitch) / 2))
    return bounds[0], bounds[1]


def _robust_top(heights: np.ndarray) -> float:
    k = max(2, int(np.ceil(0.02 * heights.size)))
    return float(np.partition(heights, -k)[-k])


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
    """Crops the height image around grasps, turned so that the fingers close along the columns.

    A patch is a rectangle of the horizontal plane through the grasp point, centred on it: the grasp frame's
    x points right, its y, the closing direction, up. It is sampled bilinearly. Invalid pixels do not
    spread: they are left out of the interpolation, and where they prevail the table (0) is assumed, as
    outside the image.

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
    axes = _patch_axes(grasps.to(heights.device), intrinsics, T_base_camera)
    along, across = (
        (torch.arange(n, device=heights.device, dtype=torch.float32) - (n - 1) / 2) * (side / n_pixels)
        for n in (n_pixels, n_columns)
    )
    up, right = (values.flatten() for values in torch.meshgrid(-along, across, indexing="ij"))
    points = torch.stack([torch.ones_like(up), right, up])
    distance = axes[..., 2] @ points
    if distance.numel() and float(distance.min()) < 1e-6:
        distance.clamp_(min=1e-6)  # what is behind the camera lands far outside
    where = torch.empty(*distance.shape, 2, device=heights.device)  # (n, pixels, 2)
    for k, size in enumerate((width, height)):
        # To grid_sample's units before the division by the distance: (2 / (width - 1)) u - 1.
        unit = axes[..., k] * (2 / (size - 1)) - axes[..., 2]
        torch.div(unit @ points, distance, out=where[..., k])
    return _sampled(heights, where).reshape(-1, 1, n_pixels, n_columns)


def _sampled(heights: Tensor, where: Tensor) -> Tensor:
    """Heights (a, b) between the pixels of one image (h, w), or of a images (a, h, w), at (a, b, 2)."""
    one = heights.ndim == 2
    images = heights[None, None] if one else heights[:, None]
    grid = where[None] if one else where[:, None]
    valid = ~torch.isnan(images)
    if bool(valid.all()):
        value = torch.nn.functional.grid_sample(
            images.float(), grid, mode="bilinear", padding_mode="border", align_corners=True
        )
        value = value.reshape(where.shape[:-1])
        if not where.numel() or max(float(where.max()), -float(where.min())) <= 1.0:
            return value  # all within the image
        # The share of the four pixels around a point that lies within the image, as below.
        size = torch.tensor([heights.shape[-1] - 1, heights.shape[-2] - 1], device=heights.device) / 2
        inside = (1 - (where.abs() - 1).clamp(min=0) * size).clamp(min=0).prod(dim=-1) >= 0.5
        return torch.where(inside, value, 0.0)
    source = torch.cat([torch.where(valid, images, 0.0), valid.to(images.dtype)], dim=1).float()
    sampled = torch.nn.functional.grid_sample(
        source, grid, mode="bilinear", padding_mode="zeros", align_corners=True
    )
    value, weight = (sampled[:, k].reshape(where.shape[:-1]) for k in (0, 1))
    return torch.where(weight >= 0.5, value / weight.clamp(min=0.5), 0.0)


def _patch_axes(grasps: Tensor, intrinsics: Array, T_base_camera: Pose) -> Tensor:
    """Homogeneous pixels (n, 3, 3) of the grasp points and of a metre along the grasp frames' x and y."""
    device = grasps.device
    grasps = grasps.double()
    matrix = torch.as_tensor(intrinsics, dtype=torch.float64, device=device)
    position = torch.as_tensor(T_base_camera.position, dtype=torch.float64, device=device)
    to_camera = quat_conjugate(torch.as_tensor(T_base_camera.quat_wxyz, dtype=torch.float64, device=device))
    cos, sin, zero = torch.cos(grasps[:, 3]), torch.sin(grasps[:, 3]), torch.zeros_like(grasps[:, 3])
    vectors_base = (
        grasps[:, :3] - position,
        torch.stack([cos, sin, zero], dim=-1),
        torch.stack([-sin, cos, zero], dim=-1),
    )
    return torch.stack(
        [(matrix @ quat_rotate(to_camera, vector)[..., None])[..., 0].float() for vector in vectors_base],
        dim=-2,
    )
