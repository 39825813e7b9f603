"""Differences between an image and a fitted pose, and which of them refuse the part."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from mskgrasp.perception.part_pose.likelihood import ExactHeights, Seen
from mskgrasp.perception.part_pose.search import Fit

UNEXPLAINED, UNEXPLAINED_SIGMAS = 0.7e-3, 3.5
"""A height farther from all of the model's within a pixel is unexplained: metres, and deviations of noise."""
EVEN = 2e-3
"""Range of heights within a pixel up to which a surface counts as even, metres."""
FARTHEST = 5e-3
"""Heights that differ by more are of something else, metres; deviations of noise are added."""
_LEVER = 2e-3
"""A surface whose points deviate less from their middle, metres, shows no tilt in that direction."""
LARGE = 2.5
"""Mean excess of 3 x 3 pixels that is large: chance exceeds it once in a million."""
MOST_PATCH, MOST_PATCH_SHARE = 5, 0.03
"""Greatest patch of large excess: pixels, and in an exact image a share of the part's pixels more: there a
facet of a body of revolution differs from the next by more than the noise."""
MOST_EXCESS, MOST_NOISY_EXCESS, EXCESS_SIGMAS = 0.6, 0.58, 4.0
"""Greatest mean excess of an exact image and of a noisy one, and how many of its deviations are added."""
MOST_UNEXPLAINED = 0.1
"""Greatest share of pixels that are unexplained."""
MOST_RISE, MOST_TILT = 0.4e-3, np.radians(1.2)
"""Greatest rise, metres, and tilt, radians: hulls in a simulation lean by up to a degree."""
SIGNIFICANT = 4.0
"""Deviations of noise by which rise and tilt must exceed them."""


@dataclass(frozen=True, kw_only=True)
class Mismatch:
    """Differences between an image and the heights that a pose would show.

    Attributes:
        pixels: Number of pixels of the part, or where the model shows it.
        excess: Mean cost of a pixel of the part above the least possible: about 0.5 where all is noise.
        excess_sigma: Standard deviation of that mean where all is noise.
        patch: Area of the largest connected patch in which the mean excess of 3 x 3 pixels is large, pixels.
        unexplained: Share of the part's pixels whose height is seen nowhere within a pixel in the model.
        rise: Mean height of the part's even surfaces above the model's, metres.
        rise_sigma: Its standard deviation, metres.
        tilt: Tilt of the part against the model, radians.
        tilt_sigma: Its standard deviation, radians.
        residual: Root of the mean squared difference of heights on even surfaces, metres.
    """

    pixels: int
    excess: float
    excess_sigma: float
    patch: int
    unexplained: float
    rise: float
    rise_sigma: float
    tilt: float
    tilt_sigma: float
    residual: float

    @classmethod
    def of(cls, fit: Fit, seen: Seen) -> Mismatch:
        """Compare an image with a fitted pose."""
        assert fit.lying.surface is not None
        exact = ExactHeights(fit.lying.surface, fit.pose, seen)
        (excess, variance), predicted = exact.excess(), exact.heights
        near_low, near_high = exact.near_low, exact.near_high
        part = seen.on_part | (predicted > 0)
        off = np.maximum(near_low - seen.heights, seen.heights - near_high)
        missed = off > UNEXPLAINED_SIGMAS * seen.sigma + UNEXPLAINED
        residual = seen.heights - predicted
        even = part & (predicted > 0) & (near_high - near_low < EVEN)
        even &= np.abs(residual) < FARTHEST + UNEXPLAINED_SIGMAS * seen.sigma
        residual = residual[even]
        rise, tilt, rise_sigma, tilt_sigma = _plane(
            seen.points[even, :2] - fit.pose[:2], residual, seen.sigma
        )
        return cls(
            pixels=int(np.count_nonzero(part)),
            excess=float(excess[part].mean()),
            excess_sigma=float(np.sqrt(variance[part].sum()) / np.count_nonzero(part)),
            patch=_largest_patch(excess, seen.window),
            unexplained=float(missed[part].mean()),
            rise=rise,
            rise_sigma=rise_sigma,
            tilt=tilt,
            tilt_sigma=tilt_sigma,
            residual=float(np.sqrt((residual**2).mean())) if len(residual) else 0.0,
        )


def _largest_patch(excess: np.ndarray, window: np.ndarray) -> int:
    """Number of neighbouring pixels around which the mean of 3 x 3 is large."""
    image, weight = np.zeros(window.shape, np.float32), window.astype(np.float32)
    image[window] = excess
    mean = cv2.blur(image, (3, 3)) / np.maximum(cv2.blur(weight, (3, 3)), 0.3)
    _, labels = cv2.connectedComponents((window & (mean > LARGE)).astype(np.uint8), connectivity=4)
    sizes = np.bincount(labels.ravel(), minlength=2)[1:]
    return int(sizes.max())


def _plane(xy: np.ndarray, heights: np.ndarray, sigma: float) -> tuple[float, float, float, float]:
    """Fit a plane to heights: rise in the middle, tilt, and standard deviations of both."""
    if len(heights) < 6:
        return 0.0, 0.0, np.inf, np.inf
    centred = xy - xy.mean(axis=0)
    moments = centred.T @ centred
    values, vectors = np.linalg.eigh(moments)
    rise = float(np.median(heights)) if sigma < 1e-3 else float(heights.mean())
    slopes = (vectors.T @ (centred.T @ (heights - heights.mean()))) / np.maximum(values, 1e-12)
    wide = values > len(heights) * _LEVER**2
    if not wide.any():
        return rise, 0.0, sigma / np.sqrt(len(heights)), np.inf
    sigmas = sigma / np.sqrt(values[wide])
    worst = int(np.argmax(np.abs(slopes[wide]) / np.maximum(sigmas, 1e-3)))
    return rise, float(abs(slopes[wide][worst])), sigma / np.sqrt(len(heights)), float(sigmas[worst])


def reason_to_refuse(mismatch: Mismatch, seen: Seen) -> str:
    """Why an image does not show the part in a resting pose; empty if it does."""
    most_excess = MOST_NOISY_EXCESS if seen.noisy else MOST_EXCESS
    most_excess += EXCESS_SIGMAS * mismatch.excess_sigma
    most_patch = MOST_PATCH + (0 if seen.noisy else MOST_PATCH_SHARE * mismatch.pixels)
    if mismatch.unexplained > MOST_UNEXPLAINED:
        return f"{mismatch.unexplained:.0%} of its pixels are where the part has no surface"
    if abs(mismatch.rise) > MOST_RISE + SIGNIFICANT * mismatch.rise_sigma:
        return f"its surfaces are {1e3 * mismatch.rise:+z.1f} mm from where they would be"
    if mismatch.tilt > MOST_TILT + SIGNIFICANT * mismatch.tilt_sigma:
        return f"it is tilted by {np.degrees(mismatch.tilt):.1f} degrees"
    if mismatch.patch > most_patch:
        return f"a patch of {mismatch.patch} pixels differs"
    if mismatch.excess > most_excess:
        return f"its heights differ by more than noise (by {mismatch.excess:.2f}, at most {most_excess:.2f})"
    return ""
