"""Convex pieces joined where their union is nearly convex."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence

import numpy as np
from manifold3d import Manifold
from scipy.spatial import ConvexHull, QhullError

from mskgrasp.parts.solids.solid import MAX_HULL_VERTICES

_TOUCH_MM = 1e-3
"""Pieces whose boxes are farther apart do not touch."""
_ROUNDING = 1e-6
"""Share by which two computations of a volume may differ."""
_MUCH_MM3 = 5.0
"""Volume that a union must add before it is asked whether it may: less fills no opening."""

Boxes = dict[int, tuple[np.ndarray, np.ndarray]]
"""Lowest and highest corner (3,) of the box around each piece, by its number."""


def merge_hulls(hulls: Sequence[np.ndarray], slack: float = 0.002) -> list[np.ndarray]:
    """Join pieces that make a nearly convex body together, those that add the least volume first.

    Args:
        hulls: Corner points (n, 3) of each piece.
        slack: Volume that all unions together may add, as a share of the whole.
    """
    return merge_in_steps(hulls, (slack,))[0]


def merge_in_steps(
    hulls: Sequence[np.ndarray],
    slacks: Sequence[float],
    allowed: Callable[[np.ndarray], bool] = lambda joined: True,
) -> list[list[np.ndarray]]:
    """The results of `merge_hulls` with several slacks, in increasing order, for the time of the last.

    Args:
        hulls: As in `merge_hulls`.
        slacks: As its slack.
        allowed: Whether a union (n, 3) that adds much may be made.
    """
    pieces = {number: np.asarray(points, dtype=float) for number, points in enumerate(hulls)}
    volumes = {number: ConvexHull(points).volume for number, points in pieces.items()}
    boxes = {number: (points.min(axis=0), points.max(axis=0)) for number, points in pieces.items()}
    whole = sum(volumes.values())
    # What is left of each slack. More than the last one leaves is of no use to the others either.
    budgets = [slack * whole for slack in slacks]
    found: list[list[np.ndarray]] = []
    heap: list[tuple[float, int, int]] = []
    bounded: dict[tuple[int, int], float] = {}  # most that a union may add of which a bound is known so far
    joints: dict[tuple[int, int], tuple[np.ndarray, float]] = {}

    def consider(a: int, b: int) -> None:
        # A lower bound, for a tenth of the time: most unions are never the next.
        hull = Manifold.hull_points(np.concatenate([pieces[a], pieces[b]]))
        least = (1 - _ROUNDING) * hull.volume() - volumes[a] - volumes[b]
        if least < budgets[-1]:
            bounded[a, b] = budgets[-1]
            heapq.heappush(heap, (least, a, b))

    def measure(a: int, b: int) -> None:
        most, joined = bounded.pop((a, b)), _joined_hull(pieces[a], pieces[b])
        if joined is None or (added := joined[1] - volumes[a] - volumes[b]) >= most:
            return
        # The sum of their volumes counts the common volume twice.
        added += _common_volume(pieces[a], pieces[b])
        if added < most:
            joints[a, b] = joined
            heapq.heappush(heap, (added, a, b))

    numbers = sorted(pieces)
    for place, a in enumerate(numbers):
        for b in _near(a, numbers[place + 1 :], boxes):
            consider(a, b)
    fresh = len(pieces)
    while heap:
        added, a, b = heapq.heappop(heap)
        if a not in pieces or b not in pieces:
            continue
        # All that is left in the heap adds at least as much.
        while len(found) < len(budgets) and added > budgets[len(found)]:
            found.append(list(pieces.values()))
        if len(found) == len(budgets):
            break
        if (a, b) in bounded:
            measure(a, b)
            continue
        if added > _MUCH_MM3 and not allowed(joints[a, b][0]):
            continue
        budgets = [budget - max(added, 0.0) for budget in budgets]
        pieces[fresh], volumes[fresh] = joints[a, b]
        boxes[fresh] = pieces[fresh].min(axis=0), pieces[fresh].max(axis=0)
        del pieces[a], pieces[b]
        for other in _near(fresh, sorted(pieces.keys() - {fresh}), boxes):
            consider(other, fresh)
        fresh += 1
    return found + [list(pieces.values()) for _ in range(len(budgets) - len(found))]


def _near(number: int, others: Sequence[int], boxes: Boxes) -> list[int]:
    """Those of the other pieces whose boxes touch that of one piece."""
    if not others:
        return []
    low, high = boxes[number]
    lows, highs = np.array([boxes[other] for other in others]).swapaxes(0, 1)
    apart = (low > highs + _TOUCH_MM).any(axis=1) | (lows > high + _TOUCH_MM).any(axis=1)
    return [others[k] for k in np.flatnonzero(~apart).tolist()]


def _joined_hull(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Corners and volume of the hull of two bodies that touch; None where it has too many corners."""
    points = np.concatenate([a, b])
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    if len(hull.vertices) > MAX_HULL_VERTICES:
        return None
    return points[np.sort(hull.vertices)], float(hull.volume)


def _common_volume(a: np.ndarray, b: np.ndarray) -> float:
    bodies = [Manifold.hull_points(np.asarray(points, dtype=np.float64)) for points in (a, b)]
    return (bodies[0] ^ bodies[1]).volume()
