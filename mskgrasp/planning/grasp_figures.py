"""Figures of a planned grasp and of grasp attempts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Rectangle

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES, MAX_OPENING
from mskgrasp.core.palette import BLUE, FAINT, GREEN, INK, ORANGE, RED
from mskgrasp.dataset import Attempts, ShardInfo, u16_to_depth
from mskgrasp.perception.height_patches import crop_patches, height_image
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.reports.style import saved_figure

_PAD_WIDTH, _PAD_THICKNESS = 0.020, 0.008  # drawn size of a finger pad seen from above, metres
_BELOW: dict[str, Any] = dict(
    loc="upper left", bbox_to_anchor=(0.0, -0.09), ncols=3, fontsize=8, borderpad=0.0, columnspacing=1.2
)
"""A legend below the axes, where it covers nothing."""
_FEW = 6  # grasps of the best scores drawn besides the chosen one
_DEVIATIONS = 2.0  # standard deviations that ellipses show
_MM = 1e3
_LOW_MM, _HIGH_MM = 4.0, 14.0  # greatest height that counts in an outline, without and with a camera's noise
_EXACT_MM = 0.1  # median height of the table, either way, of a camera without noise


def _from_above(
    depth: np.ndarray,
    intrinsics: np.ndarray,
    T_base_camera: Pose,
    table_z: float,
    square: np.ndarray,
    side: float,
) -> np.ndarray:
    """Heights in mm of a square (x, y, z, theta) seen from above, its y up."""
    heights = height_image(torch.from_numpy(depth), intrinsics, T_base_camera, table_z)
    patch = crop_patches(
        heights, torch.from_numpy(square[None]), intrinsics, T_base_camera, n_pixels=240, side=side
    )
    return patch[0, 0].numpy() * _MM


def show_heights(
    axes: Axes, heights: np.ndarray, centre: np.ndarray | tuple[float, float], side: float, top: float
) -> Any:
    """Show heights (n, n), in the unit of ``top``, the greatest of them, in a square of ``side`` metres."""
    half = side / 2 * _MM
    x, y = centre[0] * _MM, centre[1] * _MM
    image = axes.imshow(
        heights,
        extent=(x - half, x + half, y - half, y + half),
        cmap="Greys",
        vmin=-0.15 * top,
        vmax=1.5 * top,
    )
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    axes.tick_params(length=2, labelsize=8)
    axes.spines[:].set_visible(True)
    return image


def draw_jaw(axes: Axes, origin: np.ndarray, theta: float, scale: float = 1.0) -> None:
    """Draw the open hand from above: two pads and the line along which they close, to scale (mm)."""
    closing = np.array([-np.sin(theta), np.cos(theta)])
    origin = np.asarray(origin[:2]) * _MM
    reach = MAX_OPENING / 2 * _MM
    ends = np.stack([origin - reach * closing, origin + reach * closing])
    axes.plot(*ends.T, color=BLUE, lw=1.4 * scale, ls=(0, (4, 2)), zorder=6)
    axes.plot(*origin, "o", color=BLUE, ms=3.5 * scale, zorder=7)
    width, thickness = _PAD_WIDTH * _MM, _PAD_THICKNESS * _MM
    for start in (reach, -reach - thickness):
        corner = origin + start * closing - width / 2 * np.array([np.cos(theta), np.sin(theta)])
        axes.add_patch(
            Rectangle(
                tuple(corner),
                width,
                thickness,
                angle=np.degrees(theta),
                fc=BLUE,
                ec="white",
                lw=0.8,
                zorder=7,
            )
        )


def _arrow(axes: Axes, start: np.ndarray, shift: np.ndarray, width: float = 1.8, head: float = 11) -> None:
    # An annotation, because its head keeps its size on paper at any length.
    axes.annotate(
        "",
        xy=tuple(start + shift),
        xytext=tuple(start),
        arrowprops={
            "arrowstyle": "-|>",
            "color": ORANGE,
            "lw": width,
            "mutation_scale": head,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=9,
    )


def _ellipse(axes: Axes, centre: np.ndarray, covariance: np.ndarray) -> None:
    values, vectors = np.linalg.eigh(covariance)
    diameters = 2 * _DEVIATIONS * np.sqrt(np.maximum(values, 0.0)) * _MM
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    axes.add_patch(
        Ellipse(
            tuple(centre), diameters[1], diameters[0], angle=angle, fc=ORANGE, ec=ORANGE, alpha=0.28, zorder=8
        )
    )


def draw_plan(
    frame: RgbdFrame,
    plan: GraspPlan,
    path: Path,
    *,
    point_base: np.ndarray | None = None,
    measured: np.ndarray | None = None,
    note: str = "",
) -> None:
    """Draw a plan: the part, candidates by quality, the best few, the chosen grasp and the expected shift.

    Left, the base frame from above, right, the grasp frame; both in millimetres and to scale.

    Args:
        frame: The image planned in.
        plan: The plan.
        path: The picture, PNG.
        point_base: (3,) the point of the part whose displacement is drawn, base frame, metres; None: the seen
            centre.
        measured: (4,) displacement of that point in its execution, drawn beside the expected one.
        note: A line of text under the plan's.
    """
    with saved_figure(path, 11.5, 5.9 + 0.25 * bool(note)) as figure:
        left, right = figure.subplots(1, 2)
        _draw_candidates(figure, left, frame, plan)
        point = plan.view.centre_base if point_base is None else point_base
        _draw_chosen(right, frame, plan, point, measured)
        text = _plan_text(plan, point) + (f"\n{note}" if note else "")
        figure.suptitle(text, fontsize=11, x=0.01, ha="left")


def _plan_text(plan: GraspPlan, point_base: np.ndarray) -> str:
    mean, covariance = plan.displacement_of(point_base)
    deviation = np.sqrt(np.diag(covariance))
    shift, std = mean * _MM, deviation * _MM
    names = "xyz"
    known = np.isfinite(std).all()
    parts = [
        f"{name} {shift[i]:+z.1f}" + (f" ± {std[i]:.1f}" if known else "") + " mm"
        for i, name in enumerate(names)
    ]
    turn = np.degrees(mean[3])
    spread = f" ± {np.degrees(deviation[3]):.1f}" if known else ""
    return (
        f"quality {plan.quality:.2f}     expected shift in the hand: {',  '.join(parts)},  "
        f"turn {turn:+z.1f}{spread}°     planned in {plan.seconds['total']:.1f} s"
    )


def _draw_candidates(figure: Figure, axes: Axes, frame: RgbdFrame, plan: GraspPlan) -> None:
    view = plan.view
    off = np.abs(plan.grasp.position[:2] - view.centre_base[:2]).max()
    fingers = off + np.hypot(MAX_OPENING / 2 + _PAD_THICKNESS, _PAD_WIDTH / 2)
    side = max(0.14, 1.5 * float(np.hypot(*view.size[:2])), 2.05 * float(fingers))
    # The plane of the part's top: there the picture is free of parallax.
    square = np.array([*view.centre_base[:2], view.table_z + view.size[2], 0.0])
    heights = _from_above(frame.depth, frame.intrinsics, frame.T_base_camera, view.table_z, square, side)
    show_heights(axes, heights, view.centre_base[:2], side, float(view.size[2]) * _MM)
    _outline(axes, heights, view.centre_base[:2] * _MM, side)
    order = np.argsort(plan.qualities)
    grasps = plan.candidates[order]
    dots = axes.scatter(
        *(grasps.position[:, :2] * _MM).T,
        c=plan.qualities[order],
        s=2.5,
        lw=0,
        alpha=0.4,
        vmin=0.0,
        vmax=1.0,
        zorder=4,
    )
    bar = figure.colorbar(ScalarMappable(dots.norm, dots.cmap), ax=axes, shrink=0.8, pad=0.02)
    bar.set_label("predicted quality of a candidate" if plan.planned_by == "networks" else "share lifted")
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    # Without predicted variances all scores are NaN: the order by quality remains.
    few = plan.candidates[plan.shortlist[np.argsort(plan.shortlist_scores, kind="stable")[:_FEW]]]
    for position, theta in zip(few.position, few.theta, strict=True):
        _closing_line(axes, position[:2] * _MM, float(theta))
    axes.plot([], [], color=BLUE, lw=1.0, alpha=0.6, marker="|", label=f"{len(few)} of best score")
    draw_jaw(axes, plan.grasp.position, float(plan.grasp.theta))
    axes.plot([], [], color=BLUE, lw=1.4, ls=(0, (4, 2)), marker="s", label="chosen grasp")
    axes.legend(**_BELOW)
    n = len(plan.candidates)
    axes.set(xlabel="base x, mm", ylabel="base y, mm", title="1 candidate" if n == 1 else f"{n} candidates")


def _closing_line(axes: Axes, origin: np.ndarray, theta: float) -> None:
    """The line along which an open hand closes, with a short mark at each pad (mm)."""
    closing = MAX_OPENING / 2 * _MM * np.array([-np.sin(theta), np.cos(theta)])
    along = _PAD_WIDTH / 4 * _MM * np.array([np.cos(theta), np.sin(theta)])
    for start, end in (
        (-closing, closing),
        (closing - along, closing + along),
        (-closing - along, along - closing),
    ):
        axes.plot(*np.stack([origin + start, origin + end]).T, color=BLUE, lw=1.0, alpha=0.6, zorder=5)


def _draw_chosen(
    axes: Axes, frame: RgbdFrame, plan: GraspPlan, point_base: np.ndarray, measured: np.ndarray | None
) -> None:
    side = 0.128
    heights = _from_above(
        frame.depth, frame.intrinsics, frame.T_base_camera, plan.view.table_z, plan.grasp.as_vector(), side
    )
    top = float(plan.view.size[2]) * _MM
    show_heights(axes, heights, (0.0, 0.0), side, top)
    draw_jaw(axes, np.zeros(2), 0.0)
    centre = plan.grasp.T_base_grasp.inverse().apply(point_base)[:2] * _MM
    mean, covariance = plan.displacement_of(point_base)
    shift, turn = mean[:2] * _MM, float(mean[3])
    _outlines(axes, heights, np.zeros(2), side, centre, shift, turn)
    axes.plot([], [], color=INK, lw=0.9, label="part before")
    axes.plot([], [], color=ORANGE, lw=1.3, ls="--", label="part expected in the hand")
    if measured is not None:
        _outlines(axes, heights, np.zeros(2), side, centre, measured[:2] * _MM, float(measured[3]), GREEN)
        axes.plot([], [], color=GREEN, lw=1.3, ls="--", label="part measured in the hand")
    axes.legend(**_BELOW)
    axes.plot(*centre, "+", color=ORANGE, ms=8, mew=1.5, zorder=9)
    covariance = covariance[:2, :2] if np.isfinite(covariance).all() else np.zeros((2, 2))
    axes.set(
        xlabel="grasp x, mm",
        ylabel="grasp y (closing direction), mm",
        title="The chosen grasp, in its own frame",
    )
    _draw_shift(axes, centre, shift, covariance)
    reach = float(np.hypot(*shift)) + 2 * float(np.sqrt(np.linalg.eigvalsh(covariance)[-1])) * _MM
    moved = None if measured is None else measured[:2] * _MM
    if moved is not None:
        axes.plot(*(centre + moved), "x", color=GREEN, ms=7, mew=1.8, zorder=10)
        reach = max(reach, float(np.hypot(*moved)))
    if reach < 20.0:
        _inset(axes, shift, covariance, max(1.4 * reach, 1.0), right=bool(centre[0] < 0), measured=moved)


def _draw_shift(axes: Axes, start: np.ndarray, shift: np.ndarray, covariance: np.ndarray) -> None:
    _ellipse(axes, start + shift, covariance)
    _arrow(axes, start, shift)


def _outline(
    axes: Axes, heights: np.ndarray, origin: np.ndarray, side: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[float]]:
    """Draw the part's outline; return x and y (mm), the height of each pixel and the outline's height."""
    n = heights.shape[0]
    pixel = (np.arange(n) - (n - 1) / 2) * (side * _MM / n)
    x, y = np.meshgrid(origin[0] + pixel, origin[1] - pixel)
    # A camera pixel is several of these: without the blur the outline shows its stairs.
    # Clipped, the foot of a bracket counts as much as its wall.
    exact = np.median(np.abs(heights)) < _EXACT_MM  # most of it is the table
    low = np.minimum(heights, _LOW_MM if exact else _HIGH_MM)
    smooth = cv2.GaussianBlur(low, (0, 0), 0.0015 / (side / n))
    level = [0.5 * max(float(low.max()), 0.1)]
    axes.contour(x, y, smooth, levels=level, colors=[INK], linewidths=0.9, zorder=5)
    return x, y, smooth, level


def _outlines(
    axes: Axes,
    heights: np.ndarray,
    origin: np.ndarray,
    side: float,
    centre: np.ndarray,
    shift: np.ndarray,
    turn: float,
    colour: str = ORANGE,
) -> None:
    """The part's outline, and dashed the displaced outline, turned about its centre and shifted (mm)."""
    x, y, smooth, level = _outline(axes, heights, origin, side)
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy = x - centre[0], y - centre[1]
    moved_x = centre[0] + shift[0] + cos * dx - sin * dy
    moved_y = centre[1] + shift[1] + sin * dx + cos * dy
    axes.contour(
        moved_x, moved_y, smooth, levels=level, colors=[colour], linewidths=1.3, linestyles="--", zorder=6
    )


def _inset(
    axes: Axes,
    shift: np.ndarray,
    covariance: np.ndarray,
    half: float,
    *,
    right: bool,
    measured: np.ndarray | None,
) -> None:
    inset = axes.inset_axes((0.70 if right else 0.02, 0.02, 0.28, 0.28))
    inset.set(xlim=(-half, half), ylim=(-half, half), xticks=[], yticks=[], aspect="equal")
    inset.set_facecolor("white")
    inset.spines[:].set_visible(True)
    inset.axhline(0, color=FAINT, lw=0.5)
    inset.axvline(0, color=FAINT, lw=0.5)
    _draw_shift(inset, np.zeros(2), shift, covariance)
    if measured is not None:
        inset.plot(*measured, "x", color=GREEN, ms=7, mew=1.8, zorder=10)
    bar = next(step for step in (10, 5, 2, 1, 0.5) if step <= 0.8 * half or step == 0.5)
    inset.plot([-0.9 * half, -0.9 * half + bar], [-0.85 * half] * 2, color=INK, lw=2)
    inset.text(-0.9 * half, -0.8 * half, f"{bar:g} mm", fontsize=7, va="bottom")
    inset.set_title("shift and 2σ", fontsize=8, fontweight="normal", loc="center", pad=3)


def draw_contact_sheet(
    rows: Sequence[tuple[Attempts, ShardInfo, int]], path: Path, *, title: str = "Grasp attempts"
) -> None:
    """Draw attempts from above: the hand, and the displacement of a held part.

    Args:
        rows: Attempts, their shard's information, and the row to draw.
        path: The picture, PNG.
        title: Title of the figure.
    """
    columns = min(6, max(1, len(rows)))
    lines = max(1, -(-len(rows) // columns))
    with saved_figure(path, 2.1 * columns, 2.45 * lines + 0.5) as figure:
        grid = np.atleast_1d(figure.subplots(lines, columns, squeeze=False)).ravel()
        for axes in grid[len(rows) :]:
            axes.axis("off")
        for axes, (attempts, info, row) in zip(grid, rows, strict=False):
            _draw_attempt(axes, attempts, info, row)
            axes.set_xlabel(info.part, fontsize=8, labelpad=3)
        figure.suptitle(title, fontsize=12, fontweight="bold")


def _draw_attempt(axes: Axes, attempts: Attempts, info: ShardInfo, row: int) -> None:
    side = 0.15
    grasp = attempts.grasp[row].astype(np.float64)
    centre = attempts.pose_base_obj[row, :3].astype(np.float64)
    square = np.array([*centre[:2], centre[2], 0.0])
    depth = u16_to_depth(attempts.depth[row])
    heights = _from_above(depth, info.intrinsics, info.T_base_camera, info.table_z, square, side)
    show_heights(axes, heights, centre[:2], side, max(float(heights.max()), 1.0))
    axes.set(xticks=[], yticks=[])
    success = bool(attempts.success[row])
    draw_jaw(axes, grasp, float(grasp[3]), scale=0.6)
    if success:
        displacement = attempts.displacement[row].astype(np.float64)
        cos, sin = np.cos(grasp[3]), np.sin(grasp[3])
        shift = np.array([[cos, -sin], [sin, cos]]) @ displacement[:2] * _MM
        turn = float(displacement[3])
        _outlines(axes, heights, centre[:2] * _MM, side, centre[:2] * _MM, shift, turn)
        _arrow(axes, centre[:2] * _MM, shift, width=1.3, head=7)
        distance = float(np.linalg.norm(displacement[:3])) * _MM
        caption = f"{distance:.1f} mm, {np.degrees(displacement[3]):+z.0f}°"
    else:
        caption = FAILURES[int(attempts.failure[row])]
    axes.set_title(
        caption, color=GREEN if success else RED, fontsize=9, loc="center", fontweight="normal", pad=3
    )
    for spine in axes.spines.values():
        spine.set(color=GREEN if success else RED, linewidth=1.2)
