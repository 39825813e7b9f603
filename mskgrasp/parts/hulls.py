"""Collision hulls of a part."""

from __future__ import annotations

import numpy as np
import trimesh

from mskgrasp.parts.part import Part


def hull_corners(part: Part) -> list[np.ndarray]:
    """Vertices (k, 3) of each collision hull, obj frame, metres."""
    meshes = trimesh.load_scene(part.hulls_path).geometry.values()
    return [np.asarray(mesh.vertices) * 1e-3 for mesh in meshes if isinstance(mesh, trimesh.Trimesh)]
