"""Resolution of coordinates of seven digits, as float32 has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mskgrasp.parts.importing.formats import Unreadable
from mskgrasp.parts.solids.surface import Surface

COARSEST = 1e-5
"""Largest step between neighbouring coordinates, by the length of all that the file holds."""


def check_resolution(
    objects: Sequence[Surface], farthest: float | None = None, *, coarsest: float = COARSEST
) -> None:
    """Refuse surfaces whose coordinates, stored as float32, are too coarse so far from their origin.

    Args:
        objects: As they are placed; what is damaged is left to the checks of all formats.
        farthest: Largest stored coordinate, in the unit of the objects; by default theirs.
        coarsest: Largest step between neighbouring coordinates, by the length of all objects.

    Raises:
        Unreadable: The step is larger.
    """
    bounds = np.concatenate([np.zeros((0, 3)), *map(_bounds, objects)])
    if not len(bounds) or not np.isfinite(bounds).all():
        return
    farthest = float(np.abs(bounds).max()) if farthest is None else farthest
    length = float(np.ptp(bounds, axis=0).max())
    step = float(np.spacing(np.float32(farthest)))
    if length > 0 and step > coarsest * length:
        raise Unreadable(
            f"lies {farthest / length:,.0f} times its length from its origin, where numbers of 7 digits "
            f"resolve only steps of {100 * step / length:.2g} % of it: move it to the origin and export it "
            "again"
        )


def _bounds(item: Surface) -> np.ndarray:
    """Lower and upper corner (2, 3) of the vertices that faces use; empty where there are none."""
    used = np.zeros(len(item.vertices), dtype=bool)
    used[item.faces[(item.faces >= 0) & (item.faces < len(used))]] = True
    corners = item.vertices[used]
    return np.stack([corners.min(axis=0), corners.max(axis=0)]) if len(corners) else corners
