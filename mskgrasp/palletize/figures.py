"""Figures of placements: targets, placed parts and errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import quat_to_matrix
from mskgrasp.core.palette import BLUE, FAINT, GREEN, INK, LINE, ORANGE
from mskgrasp.palletize.height_maps import HeightMaps
from mskgrasp.palletize.pallet_slots import Slot
from mskgrasp.palletize.placement_records import CORRECTIONS, Correction, Placement
from mskgrasp.palletize.summary import Group, compared_groups, corrections_of
from mskgrasp.planning.grasp_figures import draw_jaw, show_heights
from mskgrasp.reports.style import saved_figure

COLOURS: dict[Correction, str] = {"none": FAINT, "predicted": BLUE, "truth": GREEN}
TITLES: dict[Correction, str] = {
    "none": "no correction", "predicted": "corrected by the prediction", "truth": "corrected by the truth",
}  # fmt: skip
_MM = 1e3
_CUT = 0.004
"""Outlines are drawn at half this height, m."""


def draw_placement(maps: HeightMaps, placement: Placement, path: Path) -> None:
    """Draw one placement: before with the grasp, after with the target."""
    with saved_figure(path, 9.2, 4.9) as figure:
        left, right = figure.subplots(1, 2)
        _show_before(left, maps)
        left.set(title="before, with the grasp", xlabel="mm along base x", ylabel="mm along base y")
        _show_after(right, maps)
        right.set(title=f"after, {TITLES[placement.correction]}", xlabel="mm from the target, along base x")
        figure.suptitle(f"{placement.part}: {placement_text(placement)}", x=0.01, ha="left", fontsize=11)


def placement_text(placement: Placement) -> str:
    """Describe the outcome of a placement."""
    if not placement.placed:
        return f"not placed ({placement.reason})"
    if placement.translation_error is None or placement.rotation_error is None:
        return "placed, not measured"
    return f"{placement.translation_error * _MM:.1f} mm, {np.degrees(placement.rotation_error):.1f}° off"


def _show_before(axes: Axes, maps: HeightMaps) -> None:
    show_heights(axes, maps.before, (0.0, 0.0), maps.side, max(maps.top, 1e-3))
    _outline(axes, maps, 0.0, INK, "-")
    draw_jaw(axes, maps.grasp, float(maps.grasp[2]))


def _show_after(axes: Axes, maps: HeightMaps) -> None:
    if not maps.after.size:
        axes.text(0.5, 0.5, "not placed", transform=axes.transAxes, ha="center", color=ORANGE)
        axes.set(xticks=[], yticks=[])
        return
    show_heights(axes, maps.after, (0.0, 0.0), maps.side, max(maps.top, 1e-3))
    _outline(axes, maps, maps.turn, GREEN, "--")
    _cross(axes, np.zeros(2), maps.theta, 0.42 * maps.side * _MM)


def _cross(axes: Axes, at: np.ndarray, theta: float, length: float) -> None:
    """Draw the target as in the paper: a cross whose longer arm is the orientation."""
    for angle, share, width in ((theta, 1.0, 1.6), (theta + np.pi / 2, 0.4, 1.0)):
        arm = share * length * np.array([np.cos(angle), np.sin(angle)])
        axes.plot(*np.stack([at - arm, at + arm]).T, color=GREEN, lw=width, alpha=0.9, zorder=6)


def _outline(axes: Axes, maps: HeightMaps, turn: float, colour: str, line: str) -> None:
    """Draw the part's outline before the grasp, turned about its centre."""
    n = len(maps.before)
    pitch = maps.side * _MM / n
    steps = (np.arange(n) - (n - 1) / 2) * pitch
    x, y = np.meshgrid(steps, -steps)
    # Clipped, a thin plate weighs as much as a high wall. A camera pixel covers several cells: without the
    # blur the outline shows stairs.
    low = np.ascontiguousarray(np.minimum(maps.before, min(_CUT, maps.top)))
    smooth = cv2.GaussianBlur(low, (0, 0), 1.5 / pitch)
    level = [0.5 * max(float(smooth.max()), 1e-4)]
    cos, sin = np.cos(turn), np.sin(turn)
    axes.contour(
        cos * x - sin * y, sin * x + cos * y, smooth, levels=level, colors=[colour], linewidths=1.3,
        linestyles=line, zorder=5,
    )  # fmt: skip


def draw_corrections(
    rows: Sequence[tuple[Placement, dict[Correction, HeightMaps], Group]], path: Path
) -> None:
    """Draw a row for each part: before the grasp, then placed under each correction, targets in green.

    Args:
        rows: For each part one of its placements, and the height maps and placements by correction.
        path: The picture, PNG.
    """
    names: list[Correction] = [name for name in CORRECTIONS if rows and name in rows[0][1]]
    with saved_figure(path, 2.45 * (1 + len(names)), 2.6 * max(1, len(rows)) + 0.2) as figure:
        grid = figure.subplots(max(1, len(rows)), 1 + len(names), squeeze=False)
        for line, (first, maps, placements) in zip(grid, rows, strict=False):
            _show_before(line[0], next(iter(maps.values())))
            line[0].set_ylabel(first.part, fontsize=8)
            for axes, name in zip(line[1:], names, strict=True):
                _show_after(axes, maps[name])
                axes.set_xlabel(placement_text(placements[name]), fontsize=9, color=COLOURS[name])
            for axes in line:
                axes.set(xticks=[], yticks=[])
                axes.spines[:].set_visible(False)
        for axes, title in zip(grid[0], ["before", *(TITLES[name] for name in names)], strict=True):
            axes.set_title(title, fontsize=9)


def draw_errors(placements: Sequence[Placement], path: Path) -> None:
    """Draw the cumulative distribution of the errors, and the medians of each part."""
    groups = compared_groups(placements)
    names = corrections_of(placements)
    with saved_figure(path, 11.5, 4.3) as figure:
        shift, turn, parts = figure.subplots(1, 3)
        for axes, error, scale, unit in (
            (shift, "translation", _MM, "mm"),
            (turn, "rotation", 180 / np.pi, "degrees"),
        ):
            for name in names:
                values = np.sort([getattr(group[name], f"{error}_error") * scale for group in groups])
                if len(values):
                    shares = np.arange(1, len(values) + 1) / len(values)
                    label = f"{TITLES[name]}: median {np.median(values):.1f}"
                    axes.step(
                        [0, *values], [0, *shares], where="post", color=COLOURS[name], lw=1.8, label=label
                    )
            axes.set(xlabel=f"{error} error, {unit}", ylim=(0, 1.02), xlim=(0, None))
            if groups:
                axes.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0))
        shift.set_ylabel("share of placements")
        _draw_parts(parts, groups)
        if not groups:
            shift.text(0.5, 0.5, "no placement was measured", transform=shift.transAxes, ha="center")


def _draw_parts(axes: Axes, groups: list[Group]) -> None:
    if not groups or not {"none", "predicted"} <= set(groups[0]):
        axes.axis("off")
        return
    names = sorted({group["none"].part for group in groups})
    medians = np.array(
        [
            [
                np.median([g[c].translation_error or 0.0 for g in groups if g[c].part == part]) * _MM
                for c in ("none", "predicted")
            ]
            for part in names
        ]
    )
    most = 1.1 * float(medians.max()) + 0.1
    axes.plot([0, most], [0, most], color=LINE, lw=1)
    axes.plot([0, most], [0, most / 2], color=GREEN, lw=1, ls="--", label="half the error")
    axes.plot(*medians.T, "o", color=COLOURS["predicted"], ms=5, alpha=0.8)
    axes.set(xlim=(0, most), ylim=(0, most), aspect="equal", title="Median error by part, mm")
    axes.set(xlabel="no correction", ylabel="corrected by the prediction")
    axes.legend(fontsize=8, loc="upper left")


def pallet_image(
    frame: RgbdFrame, slots: Sequence[Slot], table_z: float, tops: Mapping[int, float]
) -> np.ndarray:
    """Rectify the slots from above: (h, w, 3) uint8 RGB, base x up and y to the left, 1 mm per pixel.

    Args:
        frame: Frame of the pallet, the arm out of view.
        slots: All slots.
        table_z: Height of the table, metres.
        tops: Height of the part in each filled slot, metres. In a slot of known size the parallax of the
            part's top is removed.
    """
    bounds = pallet_bounds(slots)
    image = _rectified(frame, bounds, table_z)
    for index, top in tops.items():
        size = slots[index].size
        if size is not None:
            half = np.array(size) / 2
            low, high = (np.array([slots[index].x, slots[index].y]) + sign * half for sign in (-1, 1))
            # Rows count from the greatest x, columns from the greatest y.
            rows = slice(*np.rint((bounds[1] - np.array([high[0], low[0]])) * _MM).astype(int))
            columns = slice(*np.rint((bounds[3] - np.array([high[1], low[1]])) * _MM).astype(int))
            image[rows, columns] = _rectified(frame, bounds, table_z + top)[rows, columns]
    return image


def _rectified(frame: RgbdFrame, bounds: tuple[float, float, float, float], z: float) -> np.ndarray:
    """A horizontal rectangle at height z, base frame, rectified from a frame."""
    x_min, x_max, y_min, y_max = bounds
    colour = frame.colour if frame.fine_colour is None else frame.fine_colour
    scale = colour.shape[0] / frame.depth.shape[0]
    corners = np.array([[x_max, y_max], [x_max, y_min], [x_min, y_min], [x_min, y_max]])
    rotation = quat_to_matrix(np.asarray(frame.T_base_camera.quat_wxyz))
    points = (np.column_stack([corners, np.full(4, z)]) - frame.T_base_camera.position) @ rotation
    projected = points @ np.asarray(frame.intrinsics).T
    pixels = ((projected[:, :2] / projected[:, 2:] + 0.5) * scale - 0.5).astype(np.float32)
    w, h = round((y_max - y_min) * _MM), round((x_max - x_min) * _MM)
    square = np.array([[0, 0], [w, 0], [w, h], [0, h]], dtype=np.float32)
    return cv2.warpPerspective(colour, cv2.getPerspectiveTransform(pixels, square), (w, h))


def pallet_bounds(slots: Sequence[Slot]) -> tuple[float, float, float, float]:
    """Bounds of the slots with a margin: x_min, x_max, y_min, y_max, metres."""
    half = [np.array(slot.size or (0.1, 0.1)) / 2 + 0.01 for slot in slots]
    low = np.min([[s.x, s.y] - h for s, h in zip(slots, half, strict=True)], axis=0)
    high = np.max([[s.x, s.y] + h for s, h in zip(slots, half, strict=True)], axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def draw_pallets(images: dict[Correction, np.ndarray], slots: Sequence[Slot], title: str, path: Path) -> None:
    """Draw a pallet under each correction, with targets in green and slot outlines in white."""
    x_min, x_max, y_min, y_max = pallet_bounds(slots)
    height = 4.2 * (x_max - x_min) / max(y_max - y_min, 1e-6)
    with saved_figure(path, 4.2 * len(images), height + 0.9) as figure:
        for axes, (name, image) in zip(
            figure.subplots(1, len(images), squeeze=False)[0], images.items(), strict=True
        ):
            # Right is -y and up is +x, as seen from behind the robot.
            axes.imshow(image, extent=(-y_max * _MM, -y_min * _MM, x_min * _MM, x_max * _MM))
            for slot in slots:
                at = np.array([-slot.y, slot.x]) * _MM
                length = 0.42 * (max(slot.size) if slot.size else 0.08) * _MM
                _cross(axes, at, slot.theta + np.pi / 2, length)
                if slot.size is not None:
                    w, h = slot.size[1] * _MM, slot.size[0] * _MM
                    axes.add_patch(
                        Rectangle((at[0] - w / 2, at[1] - h / 2), w, h, fill=False, ec="white", lw=1.0)
                    )
            axes.set(title=TITLES[name], xticks=[], yticks=[], aspect="equal")
            axes.spines[:].set_visible(False)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11)
