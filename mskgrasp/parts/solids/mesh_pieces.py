"""Convex pieces of any watertight mesh: layers along the direction that suits it, seldom CoACD's.

A search from fine to coarse that ends with the first set of pieces that are close and few. It depends on the
mesh alone, never on time, so that the same mesh always gives the same pieces.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh64, OpType

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.solids.decompose import (
    CLOSE_P95_MM,
    CLOSE_VOLUME_RATIO,
    CONVEX_RATIO,
    MOST_HULLS,
    convex_pieces,
    cut_up,
    split_slender,
    with_few_corners,
)
from mskgrasp.parts.solids.layers import Layers, Tolerances, TurnedMesh, layer_directions
from mskgrasp.parts.solids.measure import MOST_P95_MM, MOST_VOLUME_RATIO, HullFit, MeshSurface
from mskgrasp.parts.solids.merging import merge_in_steps

MOST_MESH_HULLS = 128
"""Greatest number of pieces of a mesh."""

FINE = (
    Tolerances(sections=0.4, outline=0.15, thickness=0.6, holes=2.6),
    Tolerances(sections=0.8, outline=0.3, thickness=1.0, holes=2.6),
    Tolerances(sections=1.5, outline=0.5, thickness=2.0, holes=2.6),
    Tolerances(sections=0.4, outline=0.15, thickness=0.6, holes=0.5),
)
"""Tolerances of layers, tried in turn until pieces are within the bounds of a fine part.

Holes up to 2.6 mm in radius are filled first, as in the built-in families: no finger fits in.
"""

_WIDEST = max(FINE, key=lambda tolerances: tolerances.sections)

COARSE = (
    Tolerances(sections=2.5, outline=0.8, thickness=3.0, holes=2.6),
    Tolerances(sections=5.0, outline=1.5, thickness=6.0, holes=4.0),
)
"""Tolerances of layers where those of a fine part need too many pieces."""

_BOUNDS = ((CLOSE_P95_MM, CLOSE_VOLUME_RATIO), (MOST_P95_MM - 0.05, MOST_VOLUME_RATIO - 0.01))
"""Bounds for joining pieces, mm and volume ratio; the second where the first leaves many.

It is closer than a fine part's, which is measured again on the mesh itself and with pieces that overlap.
"""
MOST_OPENING_MM = 3.0
"""Greatest distance from the mesh to what its pieces fill, beside the holes that layers fill: no finger fits
into what is narrower, and a wider opening stays open."""
_SLACKS = (0.005, 0.015, 0.03, 0.05, 0.08)
_COARSE_SLACKS = (0.03, 0.08, 0.15, 0.3, 0.5)
"""Shares of the volume that joining may add."""
_TRIED_DIRECTIONS = 2
"""Number of directions tried: those with the fewest pieces."""
_MOST_SPLIT = 2_000
_FAR = 3.0
"""Layers that miss the bounds of a fine part by more than this factor (thin domes) compete with CoACD."""
_LEAST_VOLUME_RATIO = 0.8
"""Least volume of pieces that represent a mesh, by the mesh's, and by theirs before slivers are left out."""
_COARSE_CONCAVITY = 0.02
"""Concavity that CoACD may leave, as a share of the mesh's length: less takes minutes."""


def mesh_pieces(mesh_mm: trimesh.Trimesh) -> tuple[np.ndarray, ...]:
    """Convex pieces of a watertight mesh: close and few where possible, otherwise as close as few can be.

    Args:
        mesh_mm: Millimetres; `mskgrasp.parts.solids.simplify.for_collision` makes one of few triangles.

    Returns:
        Corners (n, 3) of each piece, millimetres.

    Raises:
        BadPart: It is a sheet too thin for pieces of its volume, or needs too many.
    """
    if mesh_mm.convex_hull.volume <= CONVEX_RATIO * mesh_mm.volume:
        pieces = convex_pieces(mesh_mm)
        if not _is_whole(pieces, mesh_mm.volume):
            raise BadPart(_TOO_THIN)
        return pieces
    search = _Search(mesh_mm)
    for tolerances in FINE:
        found = search.fine(tolerances)
        if found is not None:
            return tuple(found)
    return tuple(search.coarse())


class _Search:
    """Joined layers of one mesh."""

    def __init__(self, mesh_mm: trimesh.Trimesh) -> None:
        self._mesh = mesh_mm
        self._surface = MeshSurface(mesh_mm)
        self._solid = Manifold(
            Mesh64(np.array(mesh_mm.vertices, np.float64), np.array(mesh_mm.faces, np.uint64))
        )
        self._turned = [TurnedMesh(mesh_mm, direction) for direction in layer_directions(mesh_mm)]

    def fine(self, tolerances: Tolerances) -> list[np.ndarray] | None:
        """Few pieces within the bounds of a fine part; None where there are none or too many."""
        best: list[np.ndarray] | None = None
        for pieces in self._sets(tolerances):
            if not self._within(_BOUNDS[-1], pieces):
                continue
            joined = self._joined(pieces)
            if joined is None:
                break  # more pieces across the next direction leave too many, too
            if not _is_whole(joined, self._mesh.volume):
                continue
            if best is None or len(joined) < len(best):
                best = joined
            if len(best) <= MOST_HULLS:
                break
        return best

    def coarse(self) -> list[np.ndarray]:
        """The closest set of joined layers that is small enough, or CoACD's pieces where it is far.

        Raises:
            BadPart: All sets lack much of the mesh's volume, or have too many pieces.
        """
        found: list[tuple[float, list[np.ndarray]]] = []
        thin = False
        for tolerances in (_WIDEST, *COARSE):
            for pieces in self._sets(tolerances):
                merged = merge_in_steps(pieces, _COARSE_SLACKS, self._stays_open)
                steps = (split_slender(step, _MOST_SPLIT) for step in merged)
                few = next((step for step in steps if len(step) <= MOST_MESH_HULLS), None)
                if few is not None and _is_whole(few, self._mesh.volume):
                    found.append((_excess(self._surface.fit(few)), few))
                thin |= few is not None
        if min((excess for excess, _ in found), default=np.inf) > _FAR:
            cut = cut_up(self._mesh, _COARSE_CONCAVITY * float(np.max(self._mesh.extents)))
            whole = next(with_few_corners(cut, np.inf))
            pieces = split_slender(whole, _MOST_SPLIT)
            few = len(pieces) <= MOST_MESH_HULLS
            # Of two thin walls one may be left out while the other becomes twice as thick.
            if few and _is_whole(pieces, max(self._mesh.volume, _volume(whole))):
                found.append((_excess(self._surface.fit(pieces)), pieces))
            thin |= few
        if not found:
            raise BadPart(_TOO_THIN if thin else _TOO_MANY)
        return min(found, key=lambda item: item[0])[1]

    def _sets(self, tolerances: Tolerances) -> Iterator[list[np.ndarray]]:
        """Sets of pieces, each of layers across another direction, the one of the fewest pieces first."""
        layers = [Layers(mesh, tolerances) for mesh in self._turned]
        for one in sorted(layers, key=lambda one: one.count)[:_TRIED_DIRECTIONS]:
            pieces = one.pieces()
            if pieces is not None:
                yield pieces

    def _joined(self, pieces: Sequence[np.ndarray]) -> list[np.ndarray] | None:
        """Pieces joined to few, as far as the bounds allow; None where too many are left."""
        merged = merge_in_steps(pieces, _SLACKS, self._stays_open)
        steps = [split_slender(step, _MOST_SPLIT) for step in (pieces, *merged)]
        if len(steps[-1]) > MOST_MESH_HULLS:
            return None
        largest_first = steps[::-1]
        joined = steps[0]
        for bounds in _BOUNDS:
            # Where a step is within the bounds, those of less slack are, too.
            place = bisect_left(largest_first, True, key=partial(self._within, bounds))
            joined = largest_first[min(place, len(steps) - 1)]
            if len(joined) <= MOST_HULLS:
                break
            largest_first = largest_first[: place + 1]
        return joined if len(joined) <= MOST_MESH_HULLS else None

    def _within(self, bounds: tuple[float, float], pieces: Sequence[np.ndarray]) -> bool:
        return bool(pieces) and self._surface.fit_within(pieces, *bounds, MOST_OPENING_MM) is not None

    def _stays_open(self, points: np.ndarray) -> bool:
        """Whether a convex body fills no opening of the mesh wider than `MOST_OPENING_MM` either way."""
        filled = Manifold.hull_points(np.asarray(points, dtype=np.float64)) - self._solid
        if filled.is_empty():
            return True
        data = filled.refine_to_length(MOST_OPENING_MM / 2).to_mesh64()
        triangles = np.asarray(data.vert_properties)[:, :3][np.asarray(data.tri_verts)]
        return bool(self._surface.surface.distance_to(triangles.mean(axis=1)).max() <= MOST_OPENING_MM)


_TOO_THIN = "it is too thin to be cut into pieces of at least 0.2 mm: make it thicker"
_TOO_MANY = (
    f"it needs more than {MOST_MESH_HULLS} convex pieces: simplify fine detail such as threads, grilles and "
    "thin walls"
)


def _is_whole(pieces: Sequence[np.ndarray], volume: float) -> bool:
    """Whether pieces, millimetres, have most of a volume, mm^3."""
    return _volume(pieces) >= _LEAST_VOLUME_RATIO * volume


def _volume(pieces: Sequence[np.ndarray]) -> float:
    bodies = [Manifold.hull_points(np.asarray(points, dtype=np.float64)) for points in pieces]
    return float(Manifold.batch_boolean(bodies, OpType.Add).volume())


def _excess(fit: HullFit) -> float:
    """By how much a fit exceeds the bounds of a fine part, as a factor."""
    ratio = max(fit.volume_ratio, 1 / fit.volume_ratio)
    return max(fit.p95 / MOST_P95_MM, (ratio - 1) / (MOST_VOLUME_RATIO - 1))
