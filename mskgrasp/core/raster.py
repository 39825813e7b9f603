"""Drawing of triangles into a grid, cell by cell."""

from __future__ import annotations

import numpy as np
from numba import njit

_FLAT = 1e-12
"""An edge that rises by less than this, in cells, has one end at every row that it crosses."""


@njit(cache=True)
def raise_cells(
    cells: np.ndarray, x: np.ndarray, y: np.ndarray, values: np.ndarray, faces: np.ndarray
) -> None:
    """Raise cells to the highest value that a triangle has in their middle, in place.

    Triangles that share an edge leave no gap between them.

    Args:
        cells: (h, w) values, row along y, column along x; the middle of cell (0, 0) is the origin.
        x: (n,) of the vertices, in cells.
        y: (n,) likewise.
        values: (n,) at the vertices; between them they are linear.
        faces: (m, 3) vertices of every triangle, in any order.
    """
    for index in range(len(faces)):
        a, b, c = faces[index]
        # Row by row, from the edge between the lowest and the highest vertex to those at the third.
        if y[a] > y[b]:
            a, b = b, a
        if y[b] > y[c]:
            b, c = c, b
        if y[a] > y[b]:
            a, b = b, a
        for row in range(max(0, int(np.ceil(y[a]))), min(len(cells) - 1, int(np.floor(y[c]))) + 1):
            start, first = _crossing(row, a, c, x, y, values)
            if row < y[b]:
                end, last = _crossing(row, a, b, x, y, values)
            else:
                end, last = _crossing(row, b, c, x, y, values)
            if start > end:
                start, end, first, last = end, start, last, first
            slope = (last - first) / (end - start) if end - start > _FLAT else 0.0
            most = min(cells.shape[1] - 1, int(np.floor(end)))
            for column in range(max(0, int(np.ceil(start))), most + 1):
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
