"""Drawing of triangles into a grid, cell by cell."""

from __future__ import annotations

import numpy as np
from numba import njit

_FLAT = 1e-12
"""Of an edge that rises by less than this, in cells, the lower end counts."""


@njit(cache=True)
def raise_cells(
    cells: np.ndarray, x: np.ndarray, y: np.ndarray, values: np.ndarray, faces: np.ndarray
) -> None:
    """Raise cells to the highest value that a triangle has in their middle, in place.

    Triangles that share an edge leave no gap between them. Of one that is seen edge-on, some value on it
    counts. Triangles with a coordinate that is not finite are left out.

    Args:
        cells: (h, w) floats, row along y, column along x; the middle of cell (0, 0) is the origin.
        x: (n,) of the vertices, in cells.
        y: (n,) likewise.
        values: (n,) at the vertices; between them they are linear.
        faces: (m, 3) vertices of every triangle, in any order.
    """
    last_row, last_column = len(cells) - 1.0, cells.shape[1] - 1.0
    for index in range(len(faces)):
        a, b, c = faces[index]
        if not np.isfinite(x[a] + x[b] + x[c] + y[a] + y[b] + y[c]):
            continue
        # Row by row, from the edge between the lowest and the highest vertex to those at the third.
        if y[a] > y[b]:
            a, b = b, a
        if y[b] > y[c]:
            b, c = c, b
        if y[a] > y[b]:
            a, b = b, a
        if y[c] < 0 or y[a] > last_row:
            continue
        # Clipped before they become integers, which have a range.
        for row in range(int(max(0.0, np.ceil(y[a]))), int(min(last_row, np.floor(y[c]))) + 1):
            start, first = _crossing(row, a, c, x, y, values)
            if row < y[b]:
                end, last = _crossing(row, a, b, x, y, values)
            else:
                end, last = _crossing(row, b, c, x, y, values)
            if start > end:
                start, end, first, last = end, start, last, first
            slope = (last - first) / (end - start) if end - start > _FLAT else 0.0
            if end < 0 or start > last_column:
                continue
            most = int(min(last_column, np.floor(end)))
            for column in range(int(max(0.0, np.ceil(start))), most + 1):
                here = first + slope * (column - start)
                if here > cells[row, column]:
                    cells[row, column] = here


@njit(cache=True)
def _crossing(
    row: int, low: int, high: int, x: np.ndarray, y: np.ndarray, values: np.ndarray
) -> tuple[float, float]:
    """Place along x at which an edge crosses a row, and its value there; the lower vertex comes first."""
    rise = y[high] - y[low]
    share = (row - y[low]) / rise if rise > _FLAT else 0.0
    return x[low] + share * (x[high] - x[low]), values[low] + share * (values[high] - values[low])
