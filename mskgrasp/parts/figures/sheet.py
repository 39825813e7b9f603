"""Contact sheet of the catalogue."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh64
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mskgrasp.core.files import write_figure
from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.core.palette import INK, SLATE
from mskgrasp.parts import store
from mskgrasp.parts.catalogue import Entry, Index, representative_entries
from mskgrasp.parts.figures.render import Body, render
from mskgrasp.parts.part import Part

_DPI = 120
_TILE = (1.12, 1.06)  # inches
_COLUMNS = 16

_MATERIALS = (
    (2000.0, (0.33, 0.45, 0.58)),  # plastics
    (4000.0, (0.82, 0.85, 0.88)),  # aluminium
    (7400.0, (0.58, 0.60, 0.63)),  # zinc, cast iron, hollow bearings
    (8200.0, (0.66, 0.72, 0.80)),  # steel
    (np.inf, (0.84, 0.68, 0.38)),  # brass, bronze
)


def draw_sheet(index: Index, out: Path, parts: int, report_progress: Callable[[int, int], None]) -> None:
    """Draw parts of every family, in the order of the families' names.

    Args:
        index: The catalogue.
        out: Picture to write.
        parts: Approximate number to draw.
        report_progress: Called with the number drawn and the number to draw.
    """
    chosen = representative_entries(index.parts.values(), parts)
    rows = -(-len(chosen) // _COLUMNS)
    width, height = _COLUMNS * _TILE[0], rows * _TILE[1] + 0.62
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    counts = index.families()
    figure.text(0.15 / width, 1 - 0.3 / height, f"{len(index.parts)} parts of {len(counts)} families",
                fontsize=17, weight="bold", color=INK, va="center")  # fmt: skip
    figure.text(1 - 0.15 / width, 1 - 0.3 / height, "longest axis below each part; colour by density",
                fontsize=10, color=SLATE, va="center", ha="right")  # fmt: skip
    for number, entry in enumerate(chosen):
        report_progress(number, len(chosen))
        row, column = divmod(number, _COLUMNS)
        left, top = column * _TILE[0], height - 0.62 - row * _TILE[1]
        axes = figure.add_axes((left / width, (top - 0.80) / height, _TILE[0] / width, 0.80 / height))
        axes.set_axis_off()
        axes.imshow(_picture(entry, int(_TILE[0] * _DPI), int(0.80 * _DPI)), interpolation="nearest")
        middle = (left + _TILE[0] / 2) / width
        figure.text(middle, (top - 0.86) / height, entry.family.replace("_", " "), fontsize=6.3, color=INK,
                    ha="center", va="center")  # fmt: skip
        figure.text(middle, (top - 0.96) / height, f"{1e3 * entry.longest_axis:.0f} mm", fontsize=5.6,
                    color=SLATE, ha="center", va="center")  # fmt: skip
    report_progress(len(chosen), len(chosen))
    metadata = {"Software": None} if out.suffix.lower() == ".png" else None
    write_figure(figure, out, dpi=_DPI, metadata=metadata)


def _picture(entry: Entry, width: int, height: int) -> np.ndarray:
    part = store.read_part(store.parts_folder() / entry.name)
    mesh = _simple(trimesh.load_mesh(part.mesh_path, process=False))
    mesh.vertices = mesh.vertices @ quat_to_matrix(part.resting.quat_wxyz[0]).T
    low = np.asarray(mesh.vertices).min(axis=0)
    mesh.vertices = np.asarray(mesh.vertices) - [0, 0, low[2]]
    return render([Body(mesh=mesh, colour=_colour(part))], width=width, height=height, table=True)


def _simple(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh with fewer triangles, without a visible difference in a tile."""
    vertices = np.array(mesh.vertices, dtype=np.float64)
    body = Manifold(Mesh64(vertices, np.array(mesh.faces, dtype=np.uint64)))
    data = body.simplify(float(np.ptp(vertices, axis=0).max()) / 400).to_mesh64()
    return trimesh.Trimesh(np.array(data.vert_properties)[:, :3], np.array(data.tri_verts), process=False)


def _colour(part: Part) -> tuple[float, float, float]:
    return next(colour for limit, colour in _MATERIALS if part.density < limit)
