"""Meshes of build123d's exact shapes, with one tolerance for all, and tables of the CAD recipes."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from mskgrasp.core.errors import BadPart

CHORD_MM = 0.1
"""Largest distance of a facet from the true surface."""

ANGLE_RAD = 0.3
"""Largest angle between neighbouring facets: 21 to a full circle."""

TABLES = Path(__file__).parent / "tables"

Row = dict[str, str]


def table(file_name: str) -> list[Row]:
    """The rows of a table beside this module, as text; lines that begin with # explain the columns."""
    with open(TABLES / file_name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def lengths(row: Row) -> dict[str, float]:
    """The numeric columns of a row: those that end in ``_mm``, ``_count`` or ``_deg``."""
    return {key: float(text) for key, text in row.items() if key.endswith(("_mm", "_count", "_deg"))}


def needs_cad(make: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a maker: silence the libraries' warnings, and name the extra where they are missing.

    Raises:
        BadPart: build123d or bd_warehouse is not installed, or could not draw the part.
    """

    @wraps(make)
    def guarded(size: dict[str, float]) -> Any:
        with warnings.catch_warnings():
            # Deprecations inside build123d and its dependencies cannot be fixed here.
            warnings.simplefilter("ignore")
            try:
                return make(size)
            except ImportError as error:
                raise BadPart(
                    f"this part is drawn with build123d and bd_warehouse ({error}): "
                    "run EXTRAS=dev,cad .ci/setup"
                ) from error
            except (ValueError, RuntimeError, KeyError) as error:
                # OpenCASCADE fails on some fillets, depending on its version.
                raise BadPart(
                    f"build123d could not draw it ({error}): install the versions that pyproject.toml names"
                ) from error

    return guarded


def mesh_of(shape: Any) -> trimesh.Trimesh:
    """Tessellate a shape that was not tessellated before: OpenCASCADE would return its earlier facets.

    Raises:
        BadPart: The facets do not close.
    """
    vertices, triangles = shape.tessellate(CHORD_MM, ANGLE_RAD)
    corners = np.array([(v.X, v.Y, v.Z) for v in vertices], dtype=np.float64)
    mesh = trimesh.Trimesh(corners, np.array(triangles), process=False)
    # Faces are meshed one by one and meet to about a nanometre.
    mesh.merge_vertices(digits_vertex=3)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if not mesh.is_watertight or mesh.volume <= 0:
        raise BadPart("its facets do not close: install the versions that pyproject.toml names")
    return trimesh.Trimesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), process=False)
