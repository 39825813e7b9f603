"""Detection of a part in a depth image by its height above the table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import torch

from mskgrasp.core.errors import NoPartFound
from mskgrasp.core.geometry import Array, Pose, quat_to_matrix
from mskgrasp.core.grasp import PartView
from mskgrasp.perception.depth_noise import QUIET, coarse_step, pixel_noise

REGION_MARGIN = 0.05
"""Greatest reach of a part in the region beyond it, metres."""
MOST_RAISED = 0.4
"""Share of the region's pixels that a part may cover: 15 cm of 34 cm, squared, are 20 %."""
ALONE = 0.2
"""Share of the part's pixels above which another group in the region is another part."""
MIN_PIXELS = 5
"""Smaller groups of pixels are specks: an M3 nut covers 6 pixels of 2.2 mm."""
LINK_DEVIATIONS = 4.0
"""A smoothed pixel rises by chance, at a Gaussian's tail, once in 30 000 by more."""
MEAN_NOISE = 0.28
"""Deviation of a smoothed pixel over that of a pixel: 1 / (2 sqrt(pi)) for a Gaussian of one pixel."""
_PLAUSIBLE_DEPTH = 20.0
"""Greatest plausible depth, metres: a depth in millimetres always exceeds it."""


@dataclass(frozen=True, kw_only=True)
class FoundPart:
    """Pixels of a detected part.

    Attributes:
        depth: (h, w) metres, NaN where invalid.
        mask: (h, w) bool.
        points_base: (3, h, w) x, y, z of the surface at every pixel, base frame, metres, NaN where invalid.
        heights: (h, w) above the measured table, metres, NaN where invalid; of a noisy image the median
            of 3 x 3 pixels, twice.
        table_offset: Measured height of the table relative to ``table_z``, metres; 0 in an exact image.
        step: Step in which a noisy image's depth comes, metres; 0: it is not coarse.
        n_other: Number of pixels of the next largest group in the region.
    """

    depth: np.ndarray
    mask: np.ndarray
    points_base: np.ndarray
    heights: np.ndarray
    table_offset: float
    step: float
    n_other: int


def find_part_pixels(
    depth: Array,
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    *,
    table_z: float,
    region: tuple[float, float, float, float],
    min_height: float = 0.002,
    part_height: float = math.inf,
) -> FoundPart:
    """Find the largest connected group of pixels higher than ``min_height``; an exact image is not filtered.

    In a noisy image, heights are smoothed (Gaussian, 1 pixel) after clipping to twice ``min_height``, so that
    the edges of higher parts stay in place. Heights are relative to the measured table, so that a constant
    depth error does not hide a flat part. ``min_height`` is at least the standard deviation of a pixel's
    noise. Noise splits narrow parts: groups up to four pixels apart are joined, and those up to eight pixels
    apart between which pixels of half that height lead from one to the other (hysteresis; Canny, IEEE PAMI 8,
    1986). Farther they do not lead: the high side of a tilted table consists of such pixels.

    Args:
        depth: (h, w) metres, NaN where invalid.
        intrinsics: (3, 3) pinhole matrix.
        T_base_camera: Pose of the camera's optical frame in the base; it need not look straight down.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max in which the part's centre lies, base frame, metres.
        min_height: Least height of a part above the table, metres.
        part_height: Height of a known part as it lies flattest, metres; infinite: it is not known.

    Raises:
        NoPartFound: Nothing rises above the table there, no pixel there has a depth, a noisy camera measures
            the table more than ``min_height`` from ``table_z``, the part reaches too far beyond the region,
            or the image is no depth in metres.
    """
    depth = _checked(np.asarray(depth.cpu() if isinstance(depth, torch.Tensor) else depth))
    points = _points_base(depth, intrinsics, T_base_camera)
    x, y, z = points
    tops = heights = z - table_z
    x_min, x_max, y_min, y_max = region
    near = (x > x_min - REGION_MARGIN) & (x < x_max + REGION_MARGIN)
    near &= (y > y_min - REGION_MARGIN) & (y < y_max + REGION_MARGIN)
    if not near.any():
        raise NoPartFound(
            f"no pixel in the region has a depth (x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}): the "
            "camera does not see it, or measures nothing there; check the region, the camera's pose, its "
            "range and its exposure"
        )
    table_offset, step = 0.0, coarse_step(depth, near)
    noise = pixel_noise(heights, near, step)
    if noise > QUIET:
        min_height = max(min_height, noise)
        tops = _median(heights)
        table_offset = _offset(heights[near] if step else tops[near], min_height, step)
        if abs(table_offset) > min_height:
            raise NoPartFound(
                f"the table is seen {1e3 * table_offset:+z.1f} mm from table_z {table_z:g}, at most "
                f"{min_height * 1e3:g} mm are tolerated: the camera's pose or table_z is wrong; calibrate "
                "again"
            )
        tops, heights = tops - table_offset, heights - table_offset
    raised, mask, n_other = _raised_group(heights, near, min_height, noise)
    if _share(raised, near) > MOST_RAISED:
        raise NoPartFound(
            f"{_share(raised, near):.0%} of the region rise more than {min_height * 1e3:g} mm above the "
            f"table (median {np.median(tops[near]) * 1e3:.1f} mm): the table is tilted, or table_z "
            f"{table_z:g} or the camera's pose is wrong; calibrate the camera again"
        )
    half = max(part_height / 2, LINK_DEVIATIONS * MEAN_NOISE * noise)
    if mask is None and half < min_height:
        raised, mask, n_other = _raised_group(heights, near, half, noise)
        mask = None if _share(raised, near) > MOST_RAISED else mask
    if mask is None and noise <= QUIET and tops[near].max() > min_height:
        raise NoPartFound(
            f"what rises more than {min_height * 1e3:g} mm above the table in the region is of fewer than "
            f"{MIN_PIXELS} pixels in one place: too small for this camera at its height"
        )
    if mask is None:
        raise NoPartFound(
            f"nothing rises more than {min_height * 1e3:g} mm above the table in the region (highest point "
            f"{tops[near].max() * 1e3:.1f} mm); put a part there, or check table_z {table_z:g} and the "
            "camera's pose"
        )
    if (_grown(mask) & raised & ~near).any():
        raise NoPartFound(
            f"the part reaches more than {REGION_MARGIN * 100:g} cm beyond the region "
            f"(x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}); move it towards the middle, or clear away "
            "what else is there"
        )
    return FoundPart(
        depth=depth, mask=mask, points_base=points, heights=tops,
        table_offset=table_offset, step=step, n_other=n_other,
    )  # fmt: skip


def _raised_group(
    heights: np.ndarray, near: np.ndarray, least: float, noise: float
) -> tuple[np.ndarray, np.ndarray | None, int]:
    """Find the pixels higher than ``least``, their largest group nearby, and the second largest's size."""
    reach, link_height = 1, least
    if noise > QUIET:
        reach, heights = 5, _mean(heights, 2 * least)
        link_height = min(least, max(least / 2, LINK_DEVIATIONS * MEAN_NOISE * noise))
    raised = heights > least
    return raised, *_largest_group(raised & near, near & (heights > link_height), reach)


def _share(raised: np.ndarray, near: np.ndarray) -> float:
    """Compute the share of the pixels nearby that are raised."""
    return np.count_nonzero(raised & near) / np.count_nonzero(near)


def view_part(
    depth: Array,
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    *,
    table_z: float,
    region: tuple[float, float, float, float],
    min_height: float = 0.002,
    part_height: float = math.inf,
    alone: bool = False,
) -> PartView:
    """Detect the part on the table: the box around its pixels (`find_part_pixels`).

    The box is aligned with the image's axes. A visible side wall bounds it directly, an edge of the top half
    a pixel beyond its last pixel. Its top is the height that 2 % of its pixels exceed, so that a flying pixel
    does not raise it.

    Args:
        depth: (h, w) metres, NaN where invalid.
        intrinsics: (3, 3) pinhole matrix.
        T_base_camera: Pose of the camera's optical frame in the base; it need not look straight down.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max in which the part's centre lies, base frame, metres.
        min_height: Least height of a part above the table, metres.
        part_height: As of `find_part_pixels`.
        alone: Refuse a second part; in a noisy image one that is more than four pixels away.

    Raises:
        NoPartFound: Nothing rises above the table there, it is cut off, reaches too far beyond the region,
            is not alone, or lies elsewhere; or the image is no depth in metres.
    """
    found = find_part_pixels(
        depth, intrinsics, T_base_camera,
        table_z=table_z, region=region, min_height=min_height, part_height=part_height,
    )  # fmt: skip
    mask, (x, y, _) = found.mask, found.points_base
    x_min, x_max, y_min, y_max = region
    if mask[[0, -1]].any() or mask[:, [0, -1]].any():
        raise NoPartFound("the part is cut off by the border of the image; move it towards the middle")
    quat_wxyz, cos, sin = _box_axes(_plain(T_base_camera.quat_wxyz))
    pitch = float(np.median(found.depth[mask])) / np.array([intrinsics[0][0], intrinsics[1][1]])
    around = _bounds(mask)
    x_around, y_around, mask_around = x[around], y[around], mask[around]
    along_x = _extent(cos * x_around + sin * y_around, mask_around, float(pitch[0]))
    along_y = _extent((cos * y_around - sin * x_around).T, mask_around.T, float(pitch[1]))
    top = _robust_top(found.heights[mask])
    along, across = sum(along_x) / 2, sum(along_y) / 2
    centre_x, centre_y = cos * along - sin * across, sin * along + cos * across
    if not (x_min <= centre_x <= x_max and y_min <= centre_y <= y_max):
        raise NoPartFound(
            f"the part lies outside the region (centre at {centre_x:.3f}, {centre_y:.3f}, region "
            f"x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}); move it, or clear away what else is there"
        )
    if alone and found.n_other > ALONE * mask.sum():
        raise NoPartFound(
            f"two things lie in the region, of {mask.sum()} and {found.n_other} pixels; take one away"
        )
    spread = np.stack([x[mask] - centre_x, y[mask] - centre_y], axis=-1)
    return PartView(
        centre_base=np.array([centre_x, centre_y, table_z + top / 2]),
        T_base_box=Pose(position=np.array([centre_x, centre_y, table_z]), quat_wxyz=np.array(quat_wxyz)),
        size=np.array([along_x[1] - along_x[0], along_y[1] - along_y[0], top]),
        gyration_radius=float(np.sqrt((spread**2).sum(axis=1).mean())),
        table_z=float(table_z),
        table_offset=found.table_offset,
    )


def _points_base(depth: np.ndarray, intrinsics: np.ndarray, T_base_camera: Pose) -> np.ndarray:
    """Compute x, y, z (3, h, w) of every pixel, base frame."""
    points = _rays(depth.shape, _plain(intrinsics), _plain(T_base_camera.quat_wxyz)) * depth
    points += np.asarray(T_base_camera.position)[:, None, None]
    return points


@lru_cache(maxsize=4)  # the camera's pose is constant
def _rays(shape: tuple[int, int], intrinsics: tuple[float, ...], quat_wxyz: tuple[float, ...]) -> np.ndarray:
    """Compute the rays (3, h, w) of a camera at depth 1, along the axes of the base."""
    rotation = quat_to_matrix(np.array(quat_wxyz))
    # The rays are linear in the pixel.
    along_u, along_v, first = (rotation @ np.linalg.inv(np.reshape(intrinsics, (3, 3)))).T[..., None, None]
    rays = along_u * np.arange(shape[1]) + (along_v * np.arange(shape[0])[:, None] + first)
    rays.flags.writeable = False
    return rays


def _checked(depth: np.ndarray) -> np.ndarray:
    """Check a depth image, and replace all that is not finite by NaN."""
    floating = np.issubdtype(depth.dtype, np.floating)
    valid = np.isfinite(depth) if floating else depth > 0
    n_valid = np.count_nonzero(valid)
    if not n_valid:
        raise NoPartFound("the depth image has no valid pixel; check the camera, its range and its exposure")
    # Counting, ten times faster than a median, gives the side of the bound it is on.
    if not floating or 2 * np.count_nonzero(valid & (depth > _PLAUSIBLE_DEPTH)) > n_valid:
        raise NoPartFound(
            f"depth is {depth.dtype} with a median of {np.median(depth[valid]):g}, expected floating metres; "
            "convert it from millimetres first"
        )
    return depth if n_valid == depth.size else np.where(valid, depth, np.nan)


def _median(heights: np.ndarray) -> np.ndarray:
    """Filter by the median of 3 x 3 pixels, twice; NaN where invalid."""
    seen = np.isfinite(heights)
    median = np.where(seen, heights, 0.0).astype(np.float32)
    for _ in range(2):
        median = cv2.medianBlur(median, 3)
    return np.where(seen, median, np.nan)


def _offset(heights: np.ndarray, least: float, step: float) -> float:
    """Estimate the table's height from heights (n,), most of which are the table's."""
    first = np.median(heights)
    table = heights[np.abs(heights - first) < least]
    return float(table.mean() if step else np.median(table))


def _mean(heights: np.ndarray, most: float) -> np.ndarray:
    """Average the clipped valid heights around each pixel; NaN where invalid."""
    seen = np.isfinite(heights)
    total, weight = (
        np.asarray(cv2.GaussianBlur(values, (0, 0), 1.0))
        for values in (np.where(seen, heights, 0.0).clip(-most, most), seen.astype(np.float64))
    )
    return np.where(seen, total / np.maximum(weight, 1e-9), np.nan)


def _largest_group(mask: np.ndarray, links: np.ndarray, reach: int) -> tuple[np.ndarray | None, int]:
    """Find the largest group of pixels, and the size of the second largest.

    Pixels are of one group if discs of a diameter of ``reach`` pixels (1: neighbours) around them touch, or
    if ``links`` within twice as far, with their neighbours, connect them.
    """
    pixels, between = mask.astype(np.uint8), _grown(links).view(np.uint8)
    discs, wide = (cv2.dilate(pixels, _disc(size)) for size in (reach, 2 * reach - 1))
    _, labels = cv2.connectedComponents(np.bitwise_or(discs, np.bitwise_and(wide, between)), connectivity=8)
    sizes = np.bincount(labels[mask], minlength=3)  # 0 is the background
    if sizes.max() < MIN_PIXELS:
        return None, 0
    return mask & (labels == int(np.argmax(sizes))), int(np.sort(sizes)[-2])


def _grown(mask: np.ndarray) -> np.ndarray:
    """A mask and the neighbours of its pixels."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def _disc(diameter: int) -> np.ndarray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter, diameter))


@lru_cache(maxsize=4)
def _box_axes(quat_wxyz: tuple[float, ...]) -> tuple[tuple[float, ...], float, float]:
    """Compute axes with z up and x along the rows of a camera's image seen from above.

    Returns:
        Their quaternion in the base, and cosine and sine of their angle.
    """
    right = quat_to_matrix(np.array(quat_wxyz))[:2, 0]
    half = math.atan2(right[1], right[0]) / 2
    axes = (math.cos(half), 0.0, 0.0, math.sin(half))
    cos, sin = quat_to_matrix(np.array(axes))[:2, 0].tolist()
    return axes, cos, sin


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).ravel().tolist())


def _bounds(mask: np.ndarray) -> tuple[slice, slice]:
    """Find rows and columns of a mask inside the border, with a margin of one pixel."""
    found = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    rows, columns = (slice(int(one[0]) - 1, int(one[-1]) + 2) for one in found)
    return rows, columns


def _extent(along: np.ndarray, mask: np.ndarray, pitch: float) -> tuple[float, float]:
    """Compute the bounds of the masked points in a coordinate (h, w) along the image's rows.

    The mask does not touch the border.
    """
    bounds = []
    for sign in (-1.0, 1.0):
        outward = np.where(mask, sign * along, -np.inf)
        row, column = np.unravel_index(int(np.argmax(outward)), mask.shape)
        neighbours = outward[row, column - 1], outward[row, column + 1]
        # On a wall two neighbouring pixels have the same coordinate, which is exact. On a flat top they
        # are a pixel apart, and the edge is, on average, half a pixel further out.
        step = outward[row, column] - max(neighbours)
        bounds.append(sign * float(outward[row, column] + min(step, pitch) / 2))
    return bounds[0], bounds[1]


def _robust_top(heights: np.ndarray) -> float:
    k = max(2, int(np.ceil(0.02 * heights.size)))
    return float(np.partition(heights, -k)[-k])
