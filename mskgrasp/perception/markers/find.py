"""Detection of the two tape squares on a part."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.core.settings import Region, Tape
from mskgrasp.perception.markers.registered import LEAST_DEPTHS, RegisteredFrame
from mskgrasp.perception.markers.spots import Spot, find_spots

LEAST_CONTRAST = 12
"""Least grey levels between the tape and its surroundings; less is noise, or another surface."""
LEAST_PIXELS = 6.0
"""Least pixels along the smaller square's side; with fewer, size and shape are quantised too coarsely."""
SPECK = 0.2
"""A white spot smaller than this share of the smaller square is ignored as a glint."""
SIZE_TOLERANCE = 0.1
"""Relative tolerance of each side, as the squares are cut by hand."""
LEAST_FILL = 0.9
"""Least share of its smallest rectangle that a square fills; a disc fills 0.79."""
REGION_MARGIN = 0.05
"""Greatest reach of a part in the region beyond it, metres."""
_STEP = 3
_NAMES = ("larger", "smaller")


@dataclass(frozen=True, kw_only=True)
class Markers:
    """Both squares of one image, the larger first.

    Attributes:
        pixels: (2, 2) column and row of their centres in the depth image; the centre of a pixel has integer
            coordinates.
        points_base: (2, 3) their centres, base frame, metres.
        sides: (2, 2) the measured longer and shorter side of each, metres.
    """

    pixels: np.ndarray
    points_base: np.ndarray
    sides: np.ndarray


def find_markers(
    frame: RgbdFrame,
    tape: Tape | None = None,
    *,
    table_z: float,
    region: Region,
    heights: tuple[float, float] | None = None,
) -> Markers:
    """Find the two squares of white tape on top of a part.

    The threshold is searched from bright to dark: it is the middle of the first long run of levels at which
    only two squares of the right sizes are white in the region.

    Args:
        frame: The part on the table and nothing else; its fine colour is used where it has one.
        tape: Sizes of the squares; None: 12 and 8 mm.
        table_z: Height of the table, base frame, metres.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        heights: Known heights of the larger and the smaller square above the table, metres; None: from the
            median of the valid depths inside each.

    Raises:
        MarkersNotFound: The image does not show exactly two such whole squares; the message says why.
    """
    tape = tape or Tape()
    view = RegisteredFrame(frame, table_z)
    middle = view.colour_pixel(np.array([sum(region[:2]) / 2, sum(region[2:]) / 2, table_z]))
    pitch = view.depth_at_height(middle, 0.0) / view.focal
    if tape.small / pitch < LEAST_PIXELS:
        raise MarkersNotFound(
            f"too coarse: the smaller square, {1e3 * tape.small:g} mm, is {tape.small / pitch:.1f} pixels "
            f"wide, at least {LEAST_PIXELS:g} are needed; use larger squares, or a finer colour image "
            "(colour_scale)"
        )
    grey = np.where(_region_mask(view, region, table_z), view.colour.min(axis=2), 0).astype(np.uint8)
    spots = _search(grey, view, tape, pitch)
    depths = []
    for i, spot in enumerate(spots):
        if heights is not None:
            depths.append(view.depth_at_height(spot.centre, heights[i]))
            continue
        measured = _depths(view, spot)
        if len(measured) < LEAST_DEPTHS:
            raise MarkersNotFound(
                f"no depth: on the {_NAMES[i]} square {len(measured)} depths are valid, at least "
                f"{LEAST_DEPTHS} are needed; use larger squares or matt tape, or give the squares' heights"
            )
        depths.append(float(np.median(measured)))
    return Markers(
        pixels=np.array([view.depth_pixel(spot.centre) for spot in spots]),
        points_base=np.array([view.point_base(s.centre, d) for s, d in zip(spots, depths, strict=True)]),
        sides=np.array([s.sides * d / view.focal for s, d in zip(spots, depths, strict=True)]),
    )


def _region_mask(view: RegisteredFrame, region: Region, table_z: float) -> np.ndarray:
    """Mask the pixels (h, w) of the colour image that show the region with a margin."""
    x_min, x_max, y_min, y_max = np.array(region) + REGION_MARGIN * np.array([-1, 1, -1, 1])
    corners = np.array([[x_min, y_min], [x_min, y_max], [x_max, y_max], [x_max, y_min]])
    pixels = view.colour_pixel(np.column_stack([corners, np.full(4, table_z)]))
    mask = np.zeros(view.colour.shape[:2], dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.rint(pixels).astype(np.int32), 1)
    return mask > 0


def _search(grey: np.ndarray, view: RegisteredFrame, tape: Tape, pitch: float) -> tuple[Spot, Spot]:
    """Search the larger and the smaller square, in the middle of the levels at which only they are white.

    Raises:
        MarkersNotFound: There are no or too few such levels.
    """
    least, most = SPECK * (tape.small / pitch) ** 2, 2 * tape.large / pitch
    run: list[tuple[Spot, Spot]] = []
    longest = run
    nearest, complaint = 0, _complaint([], [], view, tape)
    # Below the median grey level the table itself is white.
    darkest = int(np.median(grey[grey > 0])) if grey.any() else 255
    for level in range(int(grey.max()) - 1, darkest - 1, -_STEP):
        spots = find_spots(grey, level, least=least, most=most)
        kinds = [_kind(spot, view, tape, pitch) for spot in spots]
        if sorted(map(str, kinds)) == ["0", "1"]:
            run = [*run, (spots[kinds.index(0)], spots[kinds.index(1)])]
            longest = max(longest, run, key=len)
            continue
        if len(run) * _STEP >= LEAST_CONTRAST:
            break
        run = []
        near = len(set(kinds) - {None}) + (len(spots) > 0)
        if near > nearest:
            nearest, complaint = near, _complaint(spots, kinds, view, tape)
    contrast = len(longest) * _STEP
    if not longest:
        raise MarkersNotFound(complaint)
    if contrast < LEAST_CONTRAST:
        raise MarkersNotFound(
            f"too little contrast: the tape alone is white over {contrast} grey levels, at least "
            f"{LEAST_CONTRAST} are needed; light the part evenly and without glare, or use whiter tape"
        )
    return longest[len(longest) // 2]


def _kind(spot: Spot, view: RegisteredFrame, tape: Tape, pitch: float) -> int | None:
    """Classify a spot: 0 for the larger square, 1 for the smaller one, None for anything else."""
    if spot.fill < LEAST_FILL - 0.6 / spot.side:  # noise shows in the outermost pixels of small ones
        return None
    sides = _sides(spot, view)
    for number, side in enumerate(tape.sides):
        if np.abs(sides - side).max() <= SIZE_TOLERANCE * side + 0.5 * pitch:
            return number
    return None


def _depths(view: RegisteredFrame, spot: Spot) -> np.ndarray:
    return view.depths_within(spot.inside, spot.centre, 0.35 * spot.side)


def _sides(spot: Spot, view: RegisteredFrame) -> np.ndarray:
    """Compute the sides (2,) of a spot, metres, at its median depth, or the table's if none is valid."""
    depths = _depths(view, spot)
    depth = float(np.median(depths)) if len(depths) else view.depth_at_height(spot.centre, 0.0)
    return spot.sides * depth / view.focal


def _complaint(spots: list[Spot], kinds: list[int | None], view: RegisteredFrame, tape: Tape) -> str:
    """Explain why the white spots are not the two squares, and the remedy."""
    others = [spot for spot, kind in zip(spots, kinds, strict=True) if kind is None]
    found = set(kinds) - {None}
    sizes = f"{1e3 * tape.large:g} and {1e3 * tape.small:g} mm"
    if not spots:
        return (
            f"none found: nothing in the region is whiter than most of it; stick both squares ({sizes}) on "
            "top of the part, and light it without glare"
        )
    other = _describe(others[0], view) if others else ""
    if len(spots) > 2 and len(found) == 2:
        what = other or "a square that is there twice"
        return (
            f"more than two candidates: {len(spots)} white spots, among them {what}; clear away what is "
            "white, or turn the light so that it does not shine"
        )
    if found:
        seen = next(kind for kind in kinds if kind is not None)
        rest = f" whole, but {other}: covered, cut or overexposed" if others else ""
        return (
            f"one found: the {_NAMES[seen]} square is seen, the {_NAMES[1 - seen]} one is not{rest}; clear "
            "the sight, dim the light, or stick the tape on again"
        )
    return (
        f"none found: no white spot is a square of {sizes}, but {other}: covered, cut, overexposed, or "
        "no tape; stick both on top of the part, clear all else and the hand away, and dim the light"
    )


def _describe(spot: Spot, view: RegisteredFrame) -> str:
    long, short = 1e3 * _sides(spot, view)
    x, y, _ = view.point_base(spot.centre, view.depth_at_height(spot.centre, 0.0))
    return f"{long:.0f} x {short:.0f} mm near x {x:.3f}, y {y:.3f}"
