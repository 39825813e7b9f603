"""Poses of the hand that show a board in it to the camera from many sides. Pure functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from hal.charuco import Board, project
from mskgrasp.core.geometry import Pose, straight_line

TABLE_MARGIN = 0.04
"""Least height of the board's corners over the table, metres."""
_EDGE_PX = 6
_SIZE_PX = 14.0
_TRIES = 3000


@dataclass(frozen=True, kw_only=True)
class Sight:
    """Rough pose and optics of the camera, known before the calibration.

    Attributes:
        T_base_camera: Approximate pose of the camera's optical frame in the base, to a few centimetres.
        intrinsics: (3, 3) pinhole matrix in pixels.
        width: Width of the image, pixels.
        height: Height of the image, pixels.
        nearest: Least distance of the board from the camera, metres.
    """

    T_base_camera: Pose
    intrinsics: np.ndarray
    width: int
    height: int
    nearest: float


def candidate_poses(
    board: Board,
    T_tcp_board: Pose,
    sight: Sight,
    table_z: float,
    *,
    tilt_rad: float,
    rng: np.random.Generator,
    possible: Callable[[Pose], bool],
) -> Iterator[Pose]:
    """``T_base_tcp`` with the board in the camera's view, tilted to all sides, over the table.

    Args:
        board: Board in the hand.
        T_tcp_board: Approximate pose of the board in the tcp frame, to 1 or 2 cm.
        sight: Approximate pose and optics of the camera.
        table_z: Height of the table, base frame, metres.
        tilt_rad: Greatest tilt of the board against the camera's line of sight, radians.
        rng: Random generator of the poses.
        possible: Returns whether the arm can reach a ``T_base_tcp``.
    """
    # Outermost markers may be cut off: what must be seen are the inner corners.
    inner, outline = board.outline(-0.6 * board.square), board.outline(0.01)
    # The farthest the board may be: there a square is still this many pixels wide.
    farthest = float(sight.intrinsics[0, 0]) * board.square / _SIZE_PX
    camera = sight.T_base_camera
    over_table = float(camera.position[2]) - table_z - TABLE_MARGIN
    towards_camera = _leaning(camera.as_matrix()[:3, 2])
    for k in range(_TRIES):
        pixel = rng.uniform([0, 0], [sight.width - 1, sight.height - 1])
        ray = np.linalg.solve(sight.intrinsics, np.array([*pixel, 1.0]))
        falls = float(camera.position[2] - camera.apply(ray)[2])
        deepest = min(farthest, over_table / falls) if falls > 0 else farthest
        centre = camera.apply(ray * rng.uniform(min(sight.nearest, deepest), deepest))
        # Directions of the tilt go round, so that a small set has all of them; a third is tilted by less.
        towards = 2 * np.pi * 0.381966 * k
        lean = tilt_rad * rng.uniform(0.3, 1.0)
        turn = Rotation.from_rotvec(lean * np.array([np.cos(towards), np.sin(towards), 0.0]))
        T_base_board = Pose(
            position=centre,
            quat_wxyz=(towards_camera * turn * _facing(rng.uniform(-1, 1))).as_quat(scalar_first=True),
        )
        if not in_sight(inner, T_base_board, sight):
            continue
        if _lowest(outline, T_base_board) < table_z + TABLE_MARGIN:
            continue
        T_base_tcp = T_base_board @ T_tcp_board.inverse()
        if possible(T_base_tcp):
            yield T_base_tcp


def in_sight(outline: np.ndarray, T_base_board: Pose, sight: Sight) -> bool:
    """Whether the camera sees an outline (k, 3) on the board, metres, and the printed side."""
    T_camera_board = sight.T_base_camera.inverse() @ T_base_board
    points = T_camera_board.apply(outline)
    if (points[:, 2] < sight.nearest * 0.8).any():
        return False
    pixels = project(points, sight.intrinsics)
    limit = np.array([sight.width - 1, sight.height - 1]) - _EDGE_PX
    facing = T_camera_board.as_matrix()[:3, 2] @ T_camera_board.position
    return bool(facing > 0 and (pixels > _EDGE_PX).all() and (pixels < limit).all())


def way_is_clear(stops: Sequence[Pose], T_tcp_board: Pose, board: Board, table_z: float) -> bool:
    """Whether the board stays off the table while the hand moves straight from each stop to the next."""
    for start, goal in pairwise(stops):
        line = straight_line(start, goal, np.linspace(0, 1, 9))
        for position, quat_wxyz in zip(line.position, line.quat_wxyz, strict=True):
            T_base_board = Pose(position=position, quat_wxyz=quat_wxyz) @ T_tcp_board
            if _lowest(board.outline(), T_base_board) < table_z + TABLE_MARGIN / 2:
                return False
    return True


def _lowest(outline: np.ndarray, T_base_board: Pose) -> float:
    return float(T_base_board.apply(outline)[:, 2].min())


def _leaning(axis: np.ndarray) -> Rotation:
    """The smallest turn from straight down to a camera's axis (3,), base frame."""
    down = np.array([0.0, 0.0, -1.0])
    about = np.cross(down, axis)
    sine = float(np.linalg.norm(about))
    if sine < 1e-9:
        return Rotation.identity()
    return Rotation.from_rotvec(about / sine * np.arctan2(sine, down @ axis))


def _facing(share: float) -> Rotation:
    """The board face up, its x away from the base, turned by a share of 70 degrees to either side."""
    return Rotation.from_euler("z", share * np.radians(70)) * Rotation.from_euler("x", np.pi)
