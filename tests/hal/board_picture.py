"""Pictures of a calibration board at a known pose, drawn by the pinhole's homography."""

from __future__ import annotations

import cv2
import numpy as np

from hal.charuco import Board
from mskgrasp.core.geometry import Pose

INTRINSICS = np.array([[365.456, 0, 256.1], [0, 365.456, 205.4], [0, 0, 1.0]])
SHAPE = (424, 512)
_FINE = 4
_SQUARE_PX = 60


def board_picture(board: Board, T_camera_board: Pose, *, background: int = 110) -> np.ndarray:
    """(424, 512, 3) uint8 of the board with a white edge of a centimetre, a mean over 4 x 4 rays a pixel."""
    margin = 0.01
    pattern = board.image(_SQUARE_PX, margin)
    metres = board.square / _SQUARE_PX
    # Pixels of the pattern, their centres at integers, to the board's plane.
    to_board = np.diag([metres, metres, 1.0])
    to_board[:2, 2] = 0.5 * metres - np.array(board.size) / 2 - margin
    matrix = T_camera_board.as_matrix()
    to_pixels = INTRINSICS @ matrix[:3, [0, 1, 3]]
    to_fine = np.array([[_FINE, 0, (_FINE - 1) / 2], [0, _FINE, (_FINE - 1) / 2], [0, 0, 1.0]])
    grey = cv2.warpPerspective(
        pattern,
        to_fine @ to_pixels @ to_board,
        (SHAPE[1] * _FINE, SHAPE[0] * _FINE),
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(background,),
    )
    small = cv2.resize(grey, SHAPE[::-1], interpolation=cv2.INTER_AREA)
    return np.repeat(small[..., None], 3, axis=2)
