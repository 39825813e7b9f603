"""Tape squares drawn where they are known to be: every pixel gathers the light of its whole area."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.core.grasp import Grasp
from mskgrasp.perception.markers import Markers, find_markers
from tests.synthetic import INTRINSICS, N_PIXELS, OVERHEAD, REGION, TABLE_Z

SCALE, OVERSAMPLING = 3, 4


TABLE, STEEL, WHITE = 139, 195, 228


SIZE = (0.09, 0.05)


HEIGHT = 0.03


SQUARES = ((-0.03, 0.012, 0.012), (0.031, -0.008, 0.008))
"""x, y, side in the part's frame, metres."""


GRASP = Grasp(position=np.array([0.44, 0.01, 0.0115]), theta=np.array(0.4))


def at(x: float, y: float, turn: float) -> Pose:
    """``T_base_obj`` of a plate, its origin at half of its height."""
    return Pose(position=np.array([x, y, HEIGHT / 2]), quat_wxyz=quat_about_z(np.array(turn)))


def corners(x: float, y: float, width: float, length: float, pose: Pose, height: float) -> np.ndarray:
    """(4, 2) of a rectangle on the part, in pixels of depth."""
    half = np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) * [width / 2, length / 2]
    level = np.full(4, height - HEIGHT / 2)
    points = OVERHEAD.inverse().apply(pose.apply(np.column_stack([half + [x, y], level])))
    return (points @ INTRINSICS.T)[:, :2] / points[:, 2:]


def paint(image: np.ndarray, pixels: np.ndarray, grey: int) -> None:
    fine = SCALE * OVERSAMPLING
    cv2.fillConvexPoly(image, np.rint(((pixels + 0.5) * fine - 0.5) * 256).astype(np.int32), grey, shift=8)


def draw(
    pose: Pose,
    *,
    squares: tuple[tuple[float, float, float], ...] = SQUARES,
    extra: Callable[[np.ndarray], None] = lambda image: None,
    white: int = WHITE,
) -> RgbdFrame:
    image = np.full((N_PIXELS * SCALE * OVERSAMPLING,) * 2, TABLE, np.uint8)
    outline = corners(0, 0, *SIZE, pose, HEIGHT)
    paint(image, outline, STEEL)
    for x, y, side in squares:
        paint(image, corners(x, y, side, side, pose, HEIGHT), white)
    extra(image)
    gathered = image.reshape(N_PIXELS * SCALE, OVERSAMPLING, -1, OVERSAMPLING).mean(axis=(1, 3))
    fine = np.repeat(np.rint(gathered).astype(np.uint8)[..., None], 3, axis=2)
    depth = np.full((N_PIXELS, N_PIXELS), OVERHEAD.position[2], np.float32)
    cv2.fillConvexPoly(depth, np.rint(outline).astype(np.int32), OVERHEAD.position[2] - HEIGHT)
    return RgbdFrame(
        colour=fine[1::3, 1::3].copy(),
        fine_colour=fine,
        depth=depth,
        intrinsics=INTRINSICS,
        T_base_camera=OVERHEAD,
        timestamp_s=0.0,
        serial="drawn",
    )


def find(frame: RgbdFrame, heights: tuple[float, float] | None = None) -> Markers:
    return find_markers(frame, table_z=TABLE_Z, region=REGION, heights=heights)


def centres(pose: Pose) -> np.ndarray:
    return pose.apply(np.array([[x, y, HEIGHT / 2] for x, y, _ in SQUARES]))


BEFORE = at(0.45, -0.01, 0.5)


AFTER = at(0.456, -0.013, 0.62)


def spot(x: float, y: float, width: float, length: float, grey: int) -> Callable[[np.ndarray], None]:
    return lambda image: paint(image, corners(x, y, width, length, BEFORE, HEIGHT), grey)


def disc(x: float, y: float, radius_px: float) -> Callable[[np.ndarray], None]:
    def show(image: np.ndarray) -> None:
        middle = (corners(x, y, 0, 0, BEFORE, HEIGHT)[0] + 0.5) * SCALE * OVERSAMPLING
        cv2.circle(image, np.rint(middle).astype(int).tolist(), round(radius_px * OVERSAMPLING), 255, -1)

    return show


LARGE, SMALL = SQUARES
