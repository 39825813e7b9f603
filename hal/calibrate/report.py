"""Text and figures of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hal.calibrate.board_views import Picture
from hal.calibrate.hand_eye import HandEye, View
from hal.charuco import MIN_CORNERS, Board, draw, project
from hal.table import TablePlane
from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.palette import BLUE, PALE, PALE_RED
from mskgrasp.reports.style import saved_figure

_SHOWN = 6
_DEPTH_MATTERS = 0.003
"""Greatest depth error that the drift of a warming Kinect explains, metres."""


@dataclass(frozen=True, kw_only=True)
class DepthOffset:
    """Depth error of the camera at the board.

    Attributes:
        metres: Median over the board, measured minus true.
        spread: Half the range of the middle 68 % of the views, metres.
        n_views: Views in which the board had depths.
    """

    metres: float
    spread: float
    n_views: int


def depth_offset(board: Board, pictures: Sequence[Picture], found: HandEye) -> DepthOffset | None:
    """Compare the measured depth of the board's interior with its pose; None without depth."""
    offsets = []
    for i in found.used:
        picture = pictures[i]
        T_camera_board = found.T_base_camera.inverse() @ picture.T_base_tcp @ found.T_tcp_board
        # Pixels inside the outline, away from its edges, where depth mixes board and table.
        outline = T_camera_board.apply(board.outline(-0.25 * board.square))
        mask = np.zeros(picture.depth.shape, dtype=np.uint8)
        pixels = np.rint(project(outline, picture.intrinsics)).astype(np.int32)
        cv2.fillConvexPoly(mask, pixels, 1)
        rows, columns = np.nonzero((mask > 0) & np.isfinite(picture.depth))
        if len(rows) < 50:
            continue
        rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(picture.intrinsics).T
        normal = T_camera_board.as_matrix()[:3, 2]
        true = (normal @ T_camera_board.position) / (rays @ normal)
        offsets.append(np.median(picture.depth[rows, columns] - true))
    if not offsets:
        return None
    low, high = np.percentile(offsets, [16, 84])
    return DepthOffset(metres=float(np.median(offsets)), spread=float(high - low) / 2, n_views=len(offsets))


def describe(found: HandEye, views: Sequence[View], before: Pose, offset: DepthOffset | None) -> list[str]:
    """The result as lines of text."""
    x, y, z = found.T_base_camera.position
    quat = " ".join(f"{value:.5f}" for value in found.T_base_camera.quat_wxyz)
    n_corners = np.mean([len(views[index].corners.ids) for index in found.used])
    rms_px = np.sqrt(np.mean(found.rms_px**2))
    moved, turned = pose_distance(before, found.T_base_camera)
    lines = [
        f"camera      x {x:.4f} m, y {y:.4f} m, z {z:.4f} m, quaternion wxyz {quat} (base)",
        f"pictures    {len(found.used)} of {len(views)} used, {n_corners:.1f} corners in each",
        f"residuals   corners {rms_px:.2f} px, board {found.rms_translation_m * 1e3:.2f} mm and "
        f"{np.degrees(found.rms_rotation_rad):.2f} degrees (RMS, each picture on its own)",
        f"repeatable  to {found.half_translation_m * 1e3:.2f} mm at the board and "
        f"{np.degrees(found.half_rotation_rad):.3f} degrees (one half of the pictures against the other)",
        f"squares     seem {100 * (found.scale - 1):+z.2f} % larger than specified",
        f"moved by    {moved * 1e3:.2f} mm and {np.degrees(turned):.3f} degrees from the camera's "
        "previous pose",
    ]
    if offset is None:
        return [*lines, "depth       not compared: the board has no depth in the pictures"]
    remedy = ""
    if abs(offset.metres) > max(_DEPTH_MATTERS, 2 * offset.spread):
        remedy = f"; add {-offset.metres:.4f} to camera.depth_offset"
    return [
        *lines,
        f"depth       the board is measured {offset.metres * 1e3:+z.1f} mm too far, +- "
        f"{offset.spread * 1e3:.1f} mm between pictures{remedy}",
    ]


def describe_table(plane: TablePlane | None, offset: DepthOffset | None, table_z: float | None) -> str:
    """Height and tilt of the table in one line; ``table_z`` is the value of the cell file, if any."""
    if plane is None:
        return "table       not seen: too little depth over the region"
    # A camera that measures too far puts the table too low.
    z = plane.z + (0.0 if offset is None else offset.metres)
    against = "" if table_z is None else f"; the cell file says table_z {table_z:.4f} m"
    return (
        f"table       table_z {z:.4f} m by the depth image, what the camera measures too far taken off; "
        f"tilted by {np.degrees(plane.tilt_rad):.2f} degrees, noise {plane.noise * 1e3:.1f} mm{against}"
    )


def draw_corners(
    board: Board, pictures: Sequence[Picture], views: Sequence[View], found: HandEye | None, path: Path
) -> None:
    """Draw some pictures with the corners detected (circles) and expected (crosses)."""
    chosen = np.unique(np.linspace(0, len(pictures) - 1, min(_SHOWN, len(pictures))).round().astype(int))
    rows = (len(chosen) + 2) // 3
    with saved_figure(path, 12, 4.2 * rows) as figure:
        for place, index in enumerate(chosen):
            picture, view = pictures[index], views[index]
            expected = None
            if found is not None:
                T_camera_board = found.T_base_camera.inverse() @ picture.T_base_tcp @ found.T_tcp_board
                expected = project(T_camera_board.apply(board.corners()), picture.intrinsics)
            axes = figure.add_subplot(rows, 3, place + 1)
            axes.imshow(draw(picture.sighted, view.corners, expected))
            used = "" if found is None or index in found.used else ", not used"
            axes.set_title(
                f"picture {index}: {len(view.corners.ids)} of {board.n_corners} corners{used}", fontsize=10
            )
            axes.set_axis_off()


def draw_residuals(views: Sequence[View], found: HandEye, path: Path) -> None:
    """Draw the residuals of each picture in pixels, millimetres and degrees."""
    rows = (
        ("corners, px (RMS)", found.rms_px),
        ("board, mm", found.translation_m * 1e3),
        ("board, degrees", np.degrees(found.rotation_rad)),
    )
    few = {i for i, view in enumerate(views) if len(view.corners.ids) < MIN_CORNERS}
    legend = "picture (grey: too few corners; red: rejected as an outlier)"
    with saved_figure(path, 10, 6) as figure:
        for place, (name, values) in enumerate(rows):
            axes = figure.add_subplot(3, 1, place + 1)
            axes.bar(found.used, values, color=BLUE)
            for index in set(range(len(views))) - set(found.used.tolist()):
                axes.axvspan(index - 0.4, index + 0.4, color=PALE if index in few else PALE_RED)
            axes.set_ylabel(name)
            axes.set_xlim(-0.7, len(views) - 0.3)
            axes.set_xlabel(legend if place == len(rows) - 1 else "")
