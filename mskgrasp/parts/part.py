"""Data of one industrial part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mskgrasp.core.geometry import Pose

SCHEMA_VERSION = 2

FINE_P95_MM = 0.7
"""95 % of the surfaces of hulls and mesh are within this distance in a fine part."""

FINE_VOLUME_RATIO = 1.1
"""Largest ratio between the volumes of hulls and mesh in a fine part, either way."""

Grade = Literal["fine", "coarse"]
"""How closely a part's hulls represent its mesh."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part as read from its folder.

    The part's frame *obj* has its origin at the centroid of the volume and the axes of its mesh file.

    Attributes:
        name: Unique, also the folder's name; lower case letters, digits, ``-`` and ``_``.
        folder: Holds ``mesh.ply``, ``hulls.glb`` and ``part.json``.
        family: Kind of part, for example ``hex_bolt``.
        source: Origin of the dimensions, for example ``ISO 4017``.
        licence: SPDX identifier.
        dimensions: Nominal dimensions, metres (counts without a unit are allowed).
        content_hash: Hex digest of mesh, hulls and physical data.
        density: kg/m^3.
        mass: kg.
        inertia: (3, 3) about the centroid, axes of obj, kg m^2.
        principal_inertia: (3,) kg m^2.
        quat_obj_principal: (4,) wxyz, orientation of the principal axes in obj.
        extents: (3,) size of the bounding box in obj axes, metres.
        longest_axis: Longest edge of the oriented minimal box, metres.
        n_hulls: Number of convex hulls in ``hulls.glb``.
        hulls_volume: Sum of their volumes, overlaps counted twice, cubic metres.
        hull_error: Largest distance between the hulls' union and the mesh, metres.
        hull_error_p95: 95 % of both surfaces are within this distance, metres.
        hull_volume_ratio: Volume of the hulls' union divided by that of the mesh.
        resting: ``T_table_obj`` of the k stable poses (z of the table is 0): position (k, 3) with
            x = y = 0, quat_wxyz (k, 4).
        resting_probability: (k,), sums to 1.
    """

    name: str
    folder: Path
    family: str
    source: str
    licence: str
    dimensions: dict[str, float]
    content_hash: str
    density: float
    mass: float
    inertia: np.ndarray
    principal_inertia: np.ndarray
    quat_obj_principal: np.ndarray
    extents: np.ndarray
    longest_axis: float
    n_hulls: int
    hulls_volume: float
    hull_error: float
    hull_error_p95: float
    hull_volume_ratio: float
    resting: Pose
    resting_probability: np.ndarray

    @property
    def grade(self) -> Grade:
        """``fine`` where the hulls are within ``FINE_P95_MM`` and ``FINE_VOLUME_RATIO``, else ``coarse``."""
        ratio = max(self.hull_volume_ratio, 1 / self.hull_volume_ratio)
        fine = 1000 * self.hull_error_p95 <= FINE_P95_MM and ratio <= FINE_VOLUME_RATIO
        return "fine" if fine else "coarse"

    @property
    def mesh_path(self) -> Path:
        """The visual mesh, metres, obj frame."""
        return self.folder / "mesh.ply"

    @property
    def hulls_path(self) -> Path:
        """The collision hulls, one geometry each, millimetres, obj frame."""
        return self.folder / "hulls.glb"
