"""Pose of a known part from one depth image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.special import ndtr

from hal.camera import RgbdFrame
from mskgrasp.core.errors import PartNotRecognised
from mskgrasp.core.geometry import Pose
from mskgrasp.perception.depth_noise import deviation_of_steps
from mskgrasp.perception.part_detection import FoundPart, find_part_pixels
from mskgrasp.perception.part_pose.known_part import KnownPart
from mskgrasp.perception.part_pose.likelihood import Seen
from mskgrasp.perception.part_pose.mismatch import Mismatch, reason_to_refuse
from mskgrasp.perception.part_pose.search import Fit, search

EXACT = 0.2e-3
"""Deviation of heights in an exact image, metres: hulls that stand for a mesh lean by tenths of a degree."""
BORDER = 4
"""Pixels around the part that are compared, too."""
NOISY_BORDER, MOST_BORDER = 6, 25
"""The same in a noisy image, in which an end of the part may not be detected."""
SMOOTHED, FEWEST_PAIRS = 0.25, 150
"""Correlation of the noise of neighbouring pixels from which an image was smoothed, and the fewest pairs of
pixels of the table that tell it."""
MOST_DEVIATIONS = 3.0
"""A pose whose cost exceeds the least by more deviations of the difference than this is no alternative."""
COVARIANCE_SCALE, SMOOTHED_SCALE = 2.0, 8.0
"""Factor from the covariance of independent pixels to that of the errors which `tests.benchmarks.part_pose`
finds: pixels along an edge see the same error of the model, and neighbours in a smoothed image nearly the
same noise."""
FLOOR = 0.05e-3
"""Standard deviation that is always added, metres, and at the part's edge for the turn."""


@dataclass(frozen=True, kw_only=True)
class PossiblePose:
    """A pose that explains an image.

    Attributes:
        resting: Index of the resting pose.
        T_base_obj: Pose of the part.
        share: Probability relative to the other poses that explain the image.
    """

    resting: int
    T_base_obj: Pose
    share: float


@dataclass(frozen=True, kw_only=True)
class PartPose:
    """Pose of a part that rests on the table.

    Attributes:
        resting: Index of the resting pose.
        T_base_obj: Pose of the part; its height and tilt are those of the resting pose.
        covariance: (3, 3) of x, y of the part's origin, metres, and of its turn about the vertical, radians.
        symmetry: Number of turns of the part that look the same; 0: all do, and the turn means nothing.
        symmetric: Whether these turns leave the part the same (`Lying.symmetric`).
        residual: Root of the mean squared difference of heights on even surfaces, metres.
        alternatives: Other poses that explain the image nearly as well, the most likely first. Resting poses
            of a body of revolution, on its facets, are not distinguished and not listed.
    """

    resting: int
    T_base_obj: Pose
    covariance: np.ndarray
    symmetry: int
    symmetric: bool
    residual: float
    alternatives: tuple[PossiblePose, ...]


def find_part_pose(
    frame: RgbdFrame,
    known: KnownPart,
    *,
    table_z: float,
    region: tuple[float, float, float, float],
    min_height: float = 0.002,
) -> PartPose:
    """Find resting pose, place and turn of a part on the table.

    Compares the image with the heights that the camera would see of the part's mesh: all resting poses and
    turns coarsely, as seen from straight above; the best of them in perspective, moved to where the image is
    most likely. A camera that is tilted by over 17 degrees may see overhanging faces that are left out.

    Args:
        frame: Depth image of the part on the table.
        known: The part.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max in which the part's centre lies, base frame, metres.
        min_height: Least height of a part above the table, metres.

    Raises:
        NoPartFound: Nothing is on the table, or the image is no depth in metres.
        PartNotRecognised: What is there fits no resting pose of the part.
    """
    found = find_part_pixels(
        frame.depth, frame.intrinsics, frame.T_base_camera,
        table_z=table_z, region=region, min_height=min_height, part_height=known.least_top,
    )  # fmt: skip
    seen = see(found, frame, known, table_z)
    fits = search(seen, known)
    best = fits[0]
    mismatch = Mismatch.of(best, seen)
    reason = reason_to_refuse(mismatch, seen)
    if reason:
        raise PartNotRecognised(
            f"this is not {known.part.name}, or it leans on something: {reason}; "
            "put the part down flat and by itself, or name the right one"
        )
    return PartPose(
        resting=best.lying.resting,
        T_base_obj=_pose(best, known, table_z),
        covariance=_covariance(best, seen),
        symmetry=best.lying.order,
        symmetric=best.lying.symmetric,
        residual=mismatch.residual,
        alternatives=_alternatives(fits, known, table_z),
    )


def see(found: FoundPart, frame: RgbdFrame, known: KnownPart, table_z: float) -> Seen:
    """The pixels of a detected part and around it, above the table as measured there."""
    noisy = found.table_offset != 0 or found.step > 0
    position = np.asarray(frame.T_base_camera.position, dtype=float)
    pitch = float(np.median(found.depth[found.mask])) / float(frame.intrinsics[0][0])
    rows, columns = np.flatnonzero(found.mask.any(axis=1)), np.flatnonzero(found.mask.any(axis=0))
    border = BORDER
    if noisy:
        longest = 2 * max(look.radius for look in known.looks) / pitch
        missing = longest - max(rows[-1] - rows[0], columns[-1] - columns[0])
        border = int(np.clip(np.ceil(missing), NOISY_BORDER, MOST_BORDER))
    window = tuple(slice(max(int(i[0]) - border, 0), int(i[-1]) + border + 1) for i in (rows, columns))
    mask = found.mask[window]
    points = found.points_base[:, window[0], window[1]].astype(np.float64)
    points[2] -= table_z
    valid = np.isfinite(points[2])
    near = valid & _grown(mask, border)
    beside = near & ~_grown(mask, 2)
    table = points[2][beside]
    offset, noise = _middle_and_noise(table, found.step) if len(table) else (0.0, 0.0)
    smoothed = noise > EXACT and _correlation(np.where(beside, points[2] - offset, np.nan), noise) > SMOOTHED
    x, y = points[0][mask], points[1][mask]
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
    intrinsics = np.array(frame.intrinsics, dtype=float)
    intrinsics[:2, 2] -= [window[1].start, window[0].start]
    return Seen(
        points=points[:, near].T,
        heights=points[2][near] - offset,
        on_part=mask[near],
        window=near,
        sigma=float(np.hypot(noise, EXACT)),
        noisy=noisy or smoothed,
        smoothed=smoothed,
        pitch=pitch,
        centre=(low + high) / 2,
        size=high - low,
        intrinsics=intrinsics,
        T_table_camera=Pose(position=position - [0, 0, table_z], quat_wxyz=frame.T_base_camera.quat_wxyz),
    )


def _middle_and_noise(table: np.ndarray, step: float) -> tuple[float, float]:
    """Middle and standard deviation of heights (n,) around a part, metres; ``step`` as in `FoundPart`."""
    middle = float(np.median(table))
    if not step:
        return middle, 1.4826 * float(np.median(np.abs(table - middle)))
    middle = float(table[np.abs(table - middle) <= 4 * step].mean())
    return middle, max(deviation_of_steps(table - middle, step), step / np.sqrt(12))


def _correlation(heights: np.ndarray, noise: float) -> float:
    """Correlation of neighbouring heights (h, w) of the table, NaN where there is none; 0 if there are few.

    Pixels that float count as three deviations of the noise at most.
    """
    clipped = np.clip(heights / noise, -3, 3)
    products = np.concatenate(
        [(clipped[1:] * clipped[:-1]).ravel(), (clipped[:, 1:] * clipped[:, :-1]).ravel()]
    )
    known = np.isfinite(products)
    if np.count_nonzero(known) < FEWEST_PAIRS:
        return 0.0
    return float(products[known].mean() / max(float(np.nanmean(clipped**2)), 1e-12))


def _grown(mask: np.ndarray, reach: int) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0


def _pose(fit: Fit, known: KnownPart, table_z: float) -> Pose:
    return known.pose(fit.lying, *fit.pose, table_z=table_z)


def _covariance(fit: Fit, seen: Seen) -> np.ndarray:
    floor = FLOOR / np.array([1.0, 1.0, fit.look.radius])
    scale = SMOOTHED_SCALE if seen.smoothed else COVARIANCE_SCALE
    return scale * fit.covariance + np.diag(floor**2)


def _alternatives(fits: list[Fit], known: KnownPart, table_z: float) -> tuple[PossiblePose, ...]:
    """Other poses that the image does not tell from the best one.

    The likelihood is not exactly that of a camera, so that a difference of the costs counts against its own
    deviation, that of a sum of so many independent terms (Vuong, Econometrica 57, 1989).
    """
    best, near = fits[0], []
    for fit in fits[1:]:
        assert fit.pixel_costs is not None and best.pixel_costs is not None
        differences = fit.pixel_costs - best.pixel_costs
        deviation = float(np.sqrt(len(differences)) * differences.std())
        deviations = (fit.cost - best.cost) / max(deviation, 1e-9)
        if deviations <= MOST_DEVIATIONS:
            near.append((fit, float(ndtr(-deviations) / ndtr(deviations))))
    total = 1 + sum(likely for _, likely in near)
    return tuple(
        PossiblePose(resting=fit.lying.resting, T_base_obj=_pose(fit, known, table_z), share=likely / total)
        for fit, likely in near
    )
