"""Picture of a part: its mesh, its collision hulls, and its stable poses."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mskgrasp.core.files import write_figure
from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.core.palette import INK, SLATE
from mskgrasp.parts import store
from mskgrasp.parts.figures.render import Body, render
from mskgrasp.parts.part import Part

METAL = (0.68, 0.74, 0.81)
_DPI = 150
_TILES = 4


@dataclass(frozen=True, kw_only=True)
class RestingClass:
    """Stable poses that look alike: index of the first, number and total probability."""

    index: int
    count: int
    probability: float


def draw_part(part: Part, out: Path) -> None:
    """Write the picture of a part; the suffix of ``out`` chooses the format (png, svg, pdf)."""
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    record = store.read_record(part.folder)
    figure = Figure(figsize=(12.8, 7.2), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.text(0.03, 0.945, part.name, fontsize=24, weight="bold", color=INK, va="center")
    figure.text(0.03, 0.895, _facts(part), fontsize=11.5, color=SLATE, va="center")

    upright = mesh.copy()
    upright.vertices = mesh.vertices @ quat_to_matrix(part.resting.quat_wxyz[0]).T
    _tile(figure, (0.02, 0.40, 0.47, 0.46), [Body(mesh=upright, colour=METAL)], table=False)
    _tile(figure, (0.51, 0.40, 0.47, 0.46), _exploded(part), table=False)
    figure.text(0.255, 0.385, "mesh", fontsize=12, color=INK, ha="center", weight="bold")
    hulls = f"{part.n_hulls} convex hull{'s' if part.n_hulls > 1 else ''}"
    fit = (
        f"largest error {part.hull_error * 1e3:.2f} mm, 95 % under {record['hull_error_p95'] * 1e3:.2f} mm, "
        f"volume {100 * record['hull_volume_ratio'] - 100:+z.1f} %"
    )
    figure.text(0.745, 0.385, hulls, fontsize=12, color=INK, ha="center", weight="bold")
    figure.text(0.745, 0.356, fit, fontsize=10, color=SLATE, ha="center")

    classes = resting_classes(part)
    shown = classes[:_TILES]
    span = 0.96 / _TILES
    start = 0.5 - span * len(shown) / 2
    for number, found in enumerate(shown):
        pose = upright.copy()
        rotation = quat_to_matrix(part.resting.quat_wxyz[found.index])
        pose.vertices = mesh.vertices @ rotation.T + part.resting.position[found.index]
        left = start + number * span
        _tile(figure, (left, 0.075, span, 0.265), [Body(mesh=pose, colour=METAL)], table=True)
        alike = "one pose" if found.count == 1 else f"{found.count} poses alike"
        figure.text(left + span / 2, 0.048, f"{100 * found.probability:.0f} %", fontsize=14, weight="bold",
                    color=INK, ha="center", va="center")  # fmt: skip
        figure.text(left + span / 2, 0.019, alike, fontsize=9.5, color=SLATE, ha="center",
                    va="center")  # fmt: skip
    write_figure(figure, out, dpi=_DPI, metadata={"Software": None} if out.suffix.lower() == ".png" else None)


def resting_classes(part: Part) -> list[RestingClass]:
    """The stable poses grouped by appearance, the most probable group first."""
    rotation = quat_to_matrix(part.resting.quat_wxyz)
    height = part.resting.position[:, 2] / part.longest_axis
    about_vertical = np.einsum("ni,ij,nj->n", rotation[:, 2], part.inertia, rotation[:, 2])
    about_vertical = about_vertical / np.trace(part.inertia)
    classes: list[list[int]] = []
    for index in range(len(height)):
        for members in classes:
            first = members[0]
            if (
                abs(height[index] - height[first]) < 0.01
                and abs(about_vertical[index] - about_vertical[first]) < 0.01
            ):
                members.append(index)
                break
        else:
            classes.append([index])
    found = [
        RestingClass(index=m[0], count=len(m), probability=float(part.resting_probability[m].sum()))
        for m in classes
    ]
    return sorted(found, key=lambda group: -group.probability)


def _facts(part: Part) -> str:
    size = " x ".join(f"{1e3 * edge:.4g}" for edge in sorted(part.extents, reverse=True))
    return (
        f"{part.family}  ·  {part.source}  ·  {size} mm  ·  {1e3 * part.mass:.3g} g  ·  "
        f"{len(part.resting_probability)} stable poses"
    )


def _exploded(part: Part) -> list[Body]:
    """The hulls, moved apart so that each can be seen, turned like the mesh."""
    rotation = quat_to_matrix(part.resting.quat_wxyz[0])
    geometries = trimesh.load_scene(part.hulls_path).dump()
    hulls = [geometry for geometry in geometries if isinstance(geometry, trimesh.Trimesh)]
    bodies = []
    for number, hull in enumerate(hulls):
        points = np.asarray(hull.vertices) / 1000
        apart = 0.22 * points.mean(axis=0) if len(hulls) > 1 else 0.0
        moved = trimesh.Trimesh((points + apart) @ rotation.T, hull.faces, process=False)
        bodies.append(Body(mesh=moved, colour=_colour(number)))
    return bodies


def _colour(number: int) -> tuple[float, float, float]:
    """Hues by the golden ratio, so that neighbours in the list differ clearly in any number."""
    red, green, blue = colorsys.hsv_to_rgb((0.58 + 0.618034 * number) % 1.0, 0.50, 0.92)
    return red, green, blue


def _tile(
    figure: Figure, place: tuple[float, float, float, float], bodies: list[Body], *, table: bool
) -> None:
    axes = figure.add_axes(place)
    axes.set_axis_off()
    width, height = (round(size * _DPI * part) for size, part in zip((12.8, 7.2), place[2:], strict=True))
    axes.imshow(render(bodies, width=width, height=height, table=table), interpolation="nearest")
