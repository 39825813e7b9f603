"""Collision hulls of a part."""

from __future__ import annotations

import numpy as np
import trimesh

from mskgrasp.parts.part import Part


def hull_corners(part: Part) -> list[np.ndarray]:
    """Vertices (k, 3) of each collision hull, obj frame, metres."""
    loaded = trimesh.load(part.hulls_path)
    meshes = loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else [loaded]
    return [np.asarray(mesh.vertices) * 1e-3 for mesh in meshes]
