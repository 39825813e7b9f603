"""Triangle surfaces in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Error, Manifold, Mesh64

from mskgrasp.core.errors import BadPart

_MOST_CHANGE = 1e-4
"""Greatest change of the volume, as a share: manifold3d silently removes slivers, and folds with them."""


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles, millimetres: vertices (n, 3) float64, faces (m, 3) int64."""

    vertices: np.ndarray
    faces: np.ndarray

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3, 3) corner points."""
        return self.vertices[self.faces]

    @property
    def volume(self) -> float:
        """By the divergence theorem, mm^3; negative where wound inwards."""
        if len(self.faces) == 0:
            return 0.0
        a, b, c = np.moveaxis(self.triangles - self.vertices[self.faces[0, 0]], 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6

    @property
    def extents(self) -> np.ndarray:
        """(3,) size of the bounding box."""
        return np.ptp(self.vertices[np.unique(self.faces)], axis=0)


def manifold_of(surface: Surface) -> Manifold:
    """The surface as a body for boolean operations.

    Raises:
        BadPart: The surface is not closed.
    """
    body = Manifold(
        Mesh64(np.ascontiguousarray(surface.vertices), np.ascontiguousarray(surface.faces, dtype=np.uint64))
    )
    if body.status() != Error.NoError or body.is_empty():
        raise BadPart("is not a proper solid: its faces do not bound a volume; repair and export it again")
    if abs(body.volume() - surface.volume) > _MOST_CHANGE * abs(surface.volume):
        raise BadPart(
            "is not a proper solid: some of its faces are folded over their neighbours; export it again, in "
            "triangles (STL) where the format has polygons"
        )
    return body


def surface_of(body: Manifold) -> Surface:
    """A body's triangles."""
    data = body.to_mesh64()
    return Surface(
        vertices=np.array(data.vert_properties)[:, :3].copy(), faces=np.array(data.tri_verts).astype(np.int64)
    )


def joined_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """Several surfaces as one."""
    start = np.cumsum([0, *(len(item.vertices) for item in surfaces)])
    return Surface(
        vertices=np.concatenate([item.vertices for item in surfaces]),
        faces=np.concatenate([item.faces + at for item, at in zip(surfaces, start[:-1], strict=True)]),
    )
