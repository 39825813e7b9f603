"""Winding numbers of closed surfaces, and the volume that self-intersection miscounts."""

from __future__ import annotations

import numpy as np

LINES = 128
"""Lines per side of the grid along each axis; a crossing smaller than 1/128 of the part may be missed."""

_CHUNK = 2_000_000
_OFFSETS = (0.1415926, -0.2182818)
"""Keeps lines off the edges and corners of meshes on a regular grid."""


def winding_number(triangles: np.ndarray, point: np.ndarray) -> float:
    """Winding number of a closed surface, triangles (n, 3, 3), about a point: 1 inside, 0 outside.

    The sum of solid angles (van Oosterom and Strackee 1983) over 4 pi.
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    under = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return float(np.arctan2(over, under).sum() / (2 * np.pi))


def miscounted_fraction(triangles: np.ndarray) -> float:
    """The volume that an integral over the surface counts twice or as negative, as a share of that enclosed.

    Zero where the surface does not cross itself. The winding number is followed along ``LINES`` x ``LINES``
    lines along each of the three axes; the largest of the three fractions is returned. An axis along which
    no line meets the surface does not count; NaN where none does.

    Args:
        triangles: (n, 3, 3) of a closed surface wound outwards.
    """
    crossings = [_crossings(triangles, axis) for axis in range(3)]
    return max((_miscounted(ends, steps) for ends, steps in crossings if len(ends)), default=np.nan)


def _miscounted(ends: np.ndarray, steps: np.ndarray) -> float:
    """The share along the lines of one axis."""
    level = np.cumsum(steps)[:-1]
    length = np.diff(ends[:, 1])
    within = (ends[1:, 0] == ends[:-1, 0]) & (level != 0)
    wrong = float((np.abs(level - np.clip(level, 0, 1)) * length)[within].sum())
    right = float((np.clip(level, 0, 1) * length)[within].sum())
    return wrong / right if right > 0 else np.inf


def _crossings(triangles: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Crossings of lines along an axis with the surface: (m, 2) line and height; (m,) +1 in, -1 out."""
    plane = [(axis + 1) % 3, (axis + 2) % 3]
    low = triangles.reshape(-1, 3).min(axis=0)[plane]
    size = np.maximum(np.ptp(triangles.reshape(-1, 3), axis=0)[plane], 1e-300)
    # In units of the lines' spacing: line i is at i.
    flat = (triangles[:, :, plane] - low) / size * LINES - 0.5 - np.asarray(_OFFSETS)
    height = triangles[:, :, axis]
    first = np.maximum(np.ceil(flat.min(axis=1)), 0).astype(np.int64)
    last = np.minimum(np.floor(flat.max(axis=1)), LINES - 1).astype(np.int64)
    spans = np.maximum(last - first + 1, 0)
    counts = spans[:, 0] * spans[:, 1]
    touched = np.flatnonzero(counts)
    found: list[np.ndarray] = [np.zeros((0, 3))]
    start = 0
    running = np.cumsum(counts[touched])
    while start < len(touched):
        done = running[start - 1] if start else 0
        stop = max(int(np.searchsorted(running, done + _CHUNK)), start + 1)
        chosen = touched[start:stop]
        found.append(_meet(flat[chosen], height[chosen], first[chosen], spans[chosen]))
        start = stop
    rows = np.concatenate(found)
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    # A line through an edge to within rounding may miss both faces; such a line is dropped.
    line = rows[:, 0].astype(np.int64)
    balance = np.bincount(line, weights=rows[:, 2], minlength=LINES * LINES)
    rows = rows[balance[line] == 0]
    return rows[:, :2], rows[:, 2].astype(np.int64)


def _meet(flat: np.ndarray, height: np.ndarray, first: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Rows (line, height, step) of the lines in each triangle's box that pass through the triangle."""
    counts = spans[:, 0] * spans[:, 1]
    owner = np.repeat(np.arange(len(flat)), counts)
    serial = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    cell = first[owner] + np.stack([serial // spans[owner, 1], serial % spans[owner, 1]], axis=1)
    corner = flat[owner] - cell[:, None, :]
    following = np.roll(corner, -1, axis=1)
    # Twice the signed area over each edge; the weight of the corner that the edge does not touch.
    edge = corner[:, :, 0] * following[:, :, 1] - corner[:, :, 1] * following[:, :, 0]
    hit = (edge > 0).all(axis=1) | (edge < 0).all(axis=1)
    edge, owner, cell = edge[hit], owner[hit], cell[hit]
    total = edge.sum(axis=1)
    met = (np.roll(edge, -1, axis=1) * height[owner]).sum(axis=1) / total
    return np.stack([cell[:, 0] * LINES + cell[:, 1], met, -np.sign(total)], axis=1)
