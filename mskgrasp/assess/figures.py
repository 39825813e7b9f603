"""Figures of an assessment: shares placed within a distance, and grasps on the part from above."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from scipy.spatial import ConvexHull

from mskgrasp.assess.summary import Row
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FINGER_HALF_WIDTH, MAX_OPENING
from mskgrasp.core.palette import BLUE, FAINT, GREEN, INK, ORANGE, PALE
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasps
from mskgrasp.reports.style import saved_figure
from mskgrasp.trials.placed_trial import CORRECTIONS, Correction, PlacedTrial

_COLOURS: dict[Correction, str] = {"none": FAINT, "predicted": BLUE, "seen": GREEN}
_NAMES: dict[Correction, str] = {
    "none": "placed directly", "predicted": "corrected by the prediction", "seen": "part seen in the hand",
}  # fmt: skip
MOST_POSES = 6
"""Resting poses drawn, the most probable ones."""
COLUMNS = 3
"""Of them in a row."""


def draw_shares(trials: Sequence[PlacedTrial], rows: Sequence[Row], distance: float, path: Path) -> None:
    """Draw, for each condition, the share of attempts within any distance from the target.

    Args:
        trials: All trials.
        rows: Their summary.
        distance: The tolerance, metres.
        path: The picture.
    """
    conditions = list(dict.fromkeys(row.condition for row in rows))
    with saved_figure(path, 3.4 * len(conditions), 3.2) as figure:
        axes = np.atleast_1d(figure.subplots(1, len(conditions), sharey=True))
        for axis, condition in zip(axes, conditions, strict=True):
            for planner, style in (("certified", "-"), ("networks", ":")):
                found = [one for one in trials if (one.condition, one.planner) == (condition, planner)]
                for correction in CORRECTIONS:
                    errors = [error[0] for one in found if (error := one.error(correction)) is not None]
                    if found:
                        _curve(axis, errors, len(found), _COLOURS[correction], style)
            axis.axvline(1e3 * distance, color=ORANGE, linewidth=1)
            axis.set(xscale="log", xlim=(0.05, 20), ylim=(0, 1.02), title=condition, xlabel="distance, mm")
            axis.set_xticks([0.1, 1, 10], ["0.1", "1", "10"])
        axes[0].set_ylabel("share of attempts within it")
        for correction in CORRECTIONS:
            axes[0].plot([], [], color=_COLOURS[correction], label=_NAMES[correction])
        axes[0].plot([], [], color=INK, linestyle="-", label="certified grasps")
        axes[0].plot([], [], color=INK, linestyle=":", label="networks")
        axes[0].plot([], [], color=ORANGE, linewidth=1, label="tolerance")
        figure.legend(loc="outside lower center", ncols=3, fontsize=9)


def _curve(axis: Axes, errors: Sequence[float], n: int, colour: str, style: str) -> None:
    values = 1e3 * np.sort(np.asarray(errors))
    shares = np.arange(1, len(values) + 1) / n
    x = np.concatenate([[0.01], values, [100.0]])
    y = np.concatenate([[0.0], shares, [shares[-1] if len(shares) else 0.0]])
    axis.step(x, y, where="post", color=colour, linestyle=style, linewidth=1.5)


def drawn_poses(part: Part, certified: CertifiedGrasps) -> list[int]:
    """The most probable resting poses, those that are alike as one, the most probable first."""
    different = [number for number in range(len(part.resting_probability)) if number not in certified.like]
    return sorted(different, key=lambda number: -_share_of(part, certified, number))[:MOST_POSES]


def draw_grasps(part: Part, certified: CertifiedGrasps, path: Path) -> None:
    """Draw the certified grasps of the most probable resting poses from above."""
    numbers = drawn_poses(part, certified)
    mesh = trimesh.load_mesh(part.mesh_path, process=False)
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    columns = min(COLUMNS, len(numbers))
    rows = -(-len(numbers) // columns)
    with saved_figure(path, 3.4 * columns, 3.4 * rows) as figure:
        axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
        for axis in axes[len(numbers) :]:
            axis.set_axis_off()
        for axis, number in zip(axes, numbers, strict=False):
            turned = Pose(position=np.zeros(3), quat_wxyz=part.resting.quat_wxyz[number]).apply(vertices)
            _top_view(axis, 1e3 * turned, np.asarray(mesh.faces))
            grasps, _ = certified.of(number)
            reach = 1e3 * float(np.abs(turned[:, :2]).max())
            for rank, grasp in reversed(list(enumerate(grasps))):  # the best one on top
                _jaw(axis, grasp.grasp, BLUE if rank == 0 else FAINT)
                reach = max(reach, 1e3 * (float(np.abs(grasp.grasp[:2]).max()) + MAX_OPENING / 2))
            axis.set(xlim=(-reach - 6, reach + 6), ylim=(-reach - 6, reach + 6))
            share = _share_of(part, certified, number)
            grasps_text = "1 grasp" if len(grasps) == 1 else f"{len(grasps)} grasps"
            axis.set_title(f"pose {number}: {share:.0%}, {grasps_text}", fontsize=9)
            axis.set(aspect="equal", xlabel="mm")


def _share_of(part: Part, certified: CertifiedGrasps, number: int) -> float:
    alike = [other for other, (first, _) in certified.like.items() if first == number]
    return float(part.resting_probability[[number, *alike]].sum())


def _top_view(axis: Axes, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Draw a mesh from above, brighter where it is higher."""
    order = np.argsort(vertices[faces][:, :, 2].max(axis=1))
    triangles = vertices[faces[order]]
    height = triangles[:, :, 2].mean(axis=1)
    low, high = float(height.min()), float(height.max())
    shade = 0.55 + 0.4 * (height - low) / max(high - low, 1e-9)
    colours = np.repeat(shade[:, None], 3, axis=1)
    axis.add_collection(PolyCollection(list(triangles[:, :, :2]), facecolors=colours, edgecolors="none"))
    outline = vertices[ConvexHull(vertices[:, :2]).vertices, :2]
    axis.fill(*outline.T, facecolor="none", edgecolor=PALE, linewidth=0.8)


def _jaw(axis: Axes, grasp: np.ndarray, colour: str) -> None:
    x, y = 1e3 * grasp[:2]
    along = np.array([-np.sin(grasp[3]), np.cos(grasp[3])])
    across = np.array([np.cos(grasp[3]), np.sin(grasp[3])])
    half, width = 1e3 * MAX_OPENING / 2, 1e3 * FINGER_HALF_WIDTH
    for side in (-1, 1):
        pad = np.array([x, y]) + side * half * along
        ends = np.stack([pad - width * across, pad + width * across])
        axis.plot(*ends.T, color=colour, linewidth=2)
    ends = np.stack([np.array([x, y]) - half * along, np.array([x, y]) + half * along])
    axis.plot(*ends.T, color=colour, linewidth=0.8)
