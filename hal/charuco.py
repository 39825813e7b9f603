"""ChArUco calibration board: geometry, drawing, detection and pose. Pure functions.

The board's frame has its origin in the middle of the squares, x right and y down as the pattern is read,
z into the board, metres; seen face to face it is turned like the camera's optical frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose

MIN_CORNERS = 6
"""Least corners in a view: with fewer the pose of the board is uncertain."""
MIN_SQUARE_PX = 9.0
"""Markers in smaller squares are rarely read, and their corners are off by half a pixel."""
_ZOOM = 2
_N_MARKERS = 50


class Board(Config):
    """A ChArUco board: a chessboard with a marker in every white square. The default fits on A4."""

    columns: int = Field(default=5, ge=3, le=12)
    """Squares along x."""
    rows: int = Field(default=4, ge=3, le=12)
    """Squares along y."""
    square: float = Field(default=0.040, ge=0.01, le=0.1)
    """Edge of a square, m; measure the printed board over several squares."""
    marker: float = Field(default=0.030, ge=0.005, le=0.1)
    """Edge of a marker, m."""

    @model_validator(mode="after")
    def _check(self) -> Board:
        if not 0.4 * self.square <= self.marker <= 0.9 * self.square:
            raise ValueError(
                f"marker {self.marker:g} m must be 0.4 to 0.9 times the square ({self.square:g} m); legal: "
                f"{0.4 * self.square:.4f} .. {0.9 * self.square:.4f}"
            )
        if self.n_corners < MIN_CORNERS:
            raise ValueError(
                f"a board of {self.columns} x {self.rows} squares has {self.n_corners} corners, "
                f"{MIN_CORNERS} are needed; legal: 3 x 4 squares or more"
            )
        if self.columns * self.rows > 2 * _N_MARKERS + 1:
            raise ValueError(
                f"a board of {self.columns} x {self.rows} squares needs more than the {_N_MARKERS} "
                f"markers of the dictionary; legal: columns * rows <= {2 * _N_MARKERS + 1}"
            )
        return self

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the squares together, metres."""
        return self.columns * self.square, self.rows * self.square

    @property
    def n_corners(self) -> int:
        """Inner corners of the chessboard."""
        return (self.columns - 1) * (self.rows - 1)

    def outline(self, margin: float = 0.0) -> np.ndarray:
        """(4, 3) corners of the board and a margin around it, board frame, metres."""
        width, height = self.size
        x, y = width / 2 + margin, height / 2 + margin
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])

    def corners(self) -> np.ndarray:
        """(n_corners, 3) by their number, board frame, metres."""
        inner = np.asarray(_cv_board(self).getChessboardCorners(), dtype=np.float64)
        return inner - np.array([*self.size, 0.0]) / 2

    def image(self, pixels_per_square: int, margin: float = 0.0) -> np.ndarray:
        """The pattern in grey levels, uint8, with a white margin in metres around it."""
        edge = round(margin / self.square * pixels_per_square)
        size = (self.columns * pixels_per_square + 2 * edge, self.rows * pixels_per_square + 2 * edge)
        return _cv_board(self).generateImage(size, marginSize=edge)


@dataclass(frozen=True, kw_only=True)
class Corners:
    """Corners of the board detected in one image.

    Attributes:
        ids: (k,) their numbers.
        pixels: (k, 2) column and row; the centre of a pixel has integer coordinates.
    """

    ids: np.ndarray
    pixels: np.ndarray


def detect(board: Board, colour: np.ndarray) -> Corners:
    """Detect the board's corners in (h, w, 3) RGB or (h, w) grey, uint8; there may be none."""
    grey = colour if colour.ndim == 2 else cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY)
    parameters = cv2.aruco.DetectorParameters()
    # Small markers are blurred into each other: only the middle of each module is read, in smaller steps than
    # by default, and a single wrong module is corrected (the codes differ in four).
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.25
    parameters.errorCorrectionRate = 1.0
    parameters.maxErroneousBitsInBorderRate = 0.5
    detector = cv2.aruco.CharucoDetector(_cv_board(board), detectorParams=parameters)
    # A marker module of a depth camera's colour image is two pixels wide: too few to be read directly.
    larger = cv2.resize(grey, None, fx=_ZOOM, fy=_ZOOM, interpolation=cv2.INTER_CUBIC)
    pixels, ids, _, _ = detector.detectBoard(larger)
    if pixels is None or ids is None or len(ids) == 0:
        return Corners(ids=np.empty(0, dtype=np.int64), pixels=np.empty((0, 2)))
    return Corners(
        ids=np.asarray(ids, dtype=np.int64).reshape(-1),
        pixels=(np.asarray(pixels, dtype=np.float64).reshape(-1, 2) + 0.5) / _ZOOM - 0.5,
    )


def infrared_grey(infrared: np.ndarray) -> np.ndarray:
    """(h, w) uint8 of an infrared image (h, w), which is linear in the light and fades with the distance."""
    light = np.sqrt(np.maximum(infrared, 0).astype(np.float32))
    # Glints are brighter than any paper by far.
    brightest = float(np.percentile(light, 99.5))
    return np.rint((light * (255 / max(brightest, 1.0))).clip(0, 255)).astype(np.uint8)


def board_pose(board: Board, corners: Corners, intrinsics: np.ndarray) -> Pose | None:
    """``T_camera_board`` from one view; None if the corners do not determine it (too few, or collinear).

    Args:
        board: The board in view.
        corners: Its detected corners.
        intrinsics: (3, 3) pinhole matrix; the image has no distortion.
    """
    points = board.corners()[corners.ids]
    if len(points) < MIN_CORNERS or np.linalg.svd(points - points.mean(0), compute_uv=False)[1] < 1e-6:
        return None
    # A flat board has two poses of similar appearance; the one that fits better is refined.
    n_found, turns, shifts, errors = cv2.solvePnPGeneric(
        points, corners.pixels, intrinsics, None, flags=cv2.SOLVEPNP_IPPE
    )
    if not n_found:
        return None
    best = int(np.argmin(errors))
    turn, shift = cv2.solvePnPRefineLM(points, corners.pixels, intrinsics, None, turns[best], shifts[best])
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(turn)[0]
    matrix[:3, 3] = shift.ravel()
    return Pose.from_matrix(matrix) if matrix[2, 3] > 0 else None


def project(points_camera: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """Pixels (..., 2) of points (..., 3) in front of the camera, metres."""
    homogeneous = points_camera @ intrinsics.T
    return homogeneous[..., :2] / homogeneous[..., 2:]


def square_px(corners: Corners, board: Board) -> float:
    """Median distance of neighbouring corners in the image, pixels; 0 if no two are neighbours."""
    where = {int(i): pixel for i, pixel in zip(corners.ids, corners.pixels, strict=True)}
    across = board.columns - 1
    distances = [
        float(np.linalg.norm(where[j] - pixel))
        for i, pixel in where.items()
        for j in ((i + 1) if (i + 1) % across else -1, i + across)
        if j in where
    ]
    return float(np.median(distances)) if distances else 0.0


def draw(
    colour: np.ndarray, corners: Corners, expected: np.ndarray | None = None, zoom: int = 4
) -> np.ndarray:
    """The image enlarged, detected corners as green circles, expected ones (k, 2) as red crosses; RGB."""
    picture = cv2.resize(colour, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_NEAREST)
    for pixel in corners.pixels:
        cv2.circle(picture, _enlarged(pixel, zoom), 2 * zoom, (0, 200, 0), 1, cv2.LINE_AA)
    for pixel in () if expected is None else expected:
        cv2.drawMarker(picture, _enlarged(pixel, zoom), (230, 30, 30), cv2.MARKER_CROSS, 2 * zoom, 1)
    return picture


def _enlarged(pixel: np.ndarray, zoom: int) -> tuple[int, int]:
    x, y = np.rint((pixel + 0.5) * zoom - 0.5).astype(int)
    return int(x), int(y)


def _cv_board(board: Board) -> cv2.aruco.CharucoBoard:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    return cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary)
