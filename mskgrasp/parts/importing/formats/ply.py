"""PLY, binary and text."""

from __future__ import annotations

import io
import warnings

import numpy as np
import trimesh

from mskgrasp.parts.importing.formats import Loaded, Unreadable
from mskgrasp.parts.importing.formats.float32 import check_resolution
from mskgrasp.parts.solids.surface import Surface


def load_ply(content: bytes) -> Loaded:
    """Read a PLY; its unit is unknown.

    Raises:
        Unreadable: It is damaged, holds only points, or is too far from its origin.
    """
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            # From memory and without a resolver, so that the file cannot make the reader open others.
            mesh = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    except Exception as error:  # the reader raises exceptions of many types
        reason = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise Unreadable(f"is not a readable PLY ({reason[:80]}): export or copy it again") from error
    if not isinstance(mesh, trimesh.Trimesh):
        raise Unreadable("holds no triangles (a point cloud?): export it from the CAD program as a mesh")
    surface = Surface(
        vertices=np.asarray(mesh.vertices, dtype=np.float64), faces=np.asarray(mesh.faces, dtype=np.int64)
    )
    if mesh.metadata["_ply_raw"]["vertex"]["data"]["x"].dtype == np.float32:  # as its header says
        check_resolution([surface])
    return Loaded(objects=(surface,))
