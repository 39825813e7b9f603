"""Hand-eye calibration of a camera beside the arm (eye-to-hand). Pure functions.

The closed form (Park and Martin, IEEE T-RO 1994, through OpenCV) initialises a least-squares fit of the
reprojected corners of all views, over the camera's pose in the base and the board's pose in the hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hal.charuco import MIN_SQUARE_PX, Board, Corners, board_pose, project, square_px
from hal.errors import HalError
from mskgrasp.core.geometry import Pose, pose_distance

MIN_VIEWS = 8
"""Least number of views with the board."""
MIN_SPREAD_RAD = np.radians(8.0)
"""Least spread (RMS) of the hand's turns about its second most used axis; with less, errors are large."""
MAX_RMS_PX = 1.5
"""Greatest reprojection error of one camera and one rigidly held board."""
MAX_SCALE_ERROR = 0.015
"""Greatest relative error of the size of the squares; more means another board."""
MAX_HALF_M = 0.005
"""Greatest distance of the board by two calibrations from half the views each, metres; of 24 views usually
0.5 mm."""
_SLIPPED = (
    "the board probably slipped or was loose: fix it so that it cannot move in the hand, and take the "
    "pictures again"
)
_COMPARABLE = 12
"""Least number of views whose halves must agree: less than 6 views determine little."""
_OUTLIER_PX = 3.0
_LOSS_PX = 0.5


class BadCalibrationSet(HalError):
    """The views do not determine the camera's pose; the message names the remedy."""


@dataclass(frozen=True, kw_only=True)
class View:
    """View of the board in the hand.

    Attributes:
        T_base_tcp: Measured pose of the TCP in the base.
        corners: Corners of the board detected in the image.
        intrinsics: (3, 3) pinhole matrix of the image, pixels.
    """

    T_base_tcp: Pose
    corners: Corners
    intrinsics: np.ndarray


@dataclass(frozen=True, kw_only=True)
class HandEye:
    """Pose of the camera, and the residuals of the views.

    Attributes:
        T_base_camera: The camera's optical frame in the base.
        T_tcp_board: The board in the hand.
        used: (n,) indices of the views that were used.
        rms_px: (n,) RMS distance of corners found and expected, pixels.
        translation_m: (n,) distance of the board as seen and as held, metres.
        rotation_rad: (n,) angle between both, radians.
        half_translation_m: Distance of the board's mean position by two calibrations from half the views
            each, metres: about the effect of another set of poses.
        half_rotation_rad: The angle between the two calibrations, radians.
        scale: Size of the board's squares that fits best, as a fraction of the configured size.
    """

    T_base_camera: Pose
    T_tcp_board: Pose
    used: np.ndarray
    rms_px: np.ndarray
    translation_m: np.ndarray
    rotation_rad: np.ndarray
    half_translation_m: float
    half_rotation_rad: float
    scale: float

    @property
    def rms_translation_m(self) -> float:
        """RMS over the views."""
        return float(np.sqrt(np.mean(self.translation_m**2)))

    @property
    def rms_rotation_rad(self) -> float:
        """RMS over the views."""
        return float(np.sqrt(np.mean(self.rotation_rad**2)))


def solve_hand_eye(board: Board, views: Sequence[View]) -> HandEye:
    """Estimate the pose of the camera in the base.

    Raises:
        BadCalibrationSet: Too few views with the board, too little tilt, a board too small in the image,
            views that contradict each other, or halves of them that do.
    """
    seen = [board_pose(board, view.corners, view.intrinsics) for view in views]
    usable = [i for i, pose in enumerate(seen) if pose is not None]
    _refuse_small(board, views, usable)
    if len(usable) < MIN_VIEWS:
        raise BadCalibrationSet(
            f"the board's pose can be seen in {len(usable)} of {len(views)} pictures, at least {MIN_VIEWS} "
            "are needed; light the board evenly, keep it whole in the image, compare board.columns and "
            "board.rows with the printed board, or raise --poses"
        )
    poses = [pose for pose in seen if pose is not None]
    _refuse_flat([views[i].T_base_tcp for i in usable])
    start = _closed_form([views[i].T_base_tcp for i in usable], poses)
    used = np.array(usable)
    fit = _fit(board, [views[i] for i in used], *start)
    rms = _rms_px(board, [views[i] for i in used], *fit)
    good = rms < max(_OUTLIER_PX, 3 * float(np.median(rms)))
    if not good.all():
        used = used[good]
        if len(used) < MIN_VIEWS:
            raise BadCalibrationSet(_contradiction(rms))
        _refuse_flat([views[i].T_base_tcp for i in used], n_rejected=int((~good).sum()))
        fit = _fit(board, [views[i] for i in used], *fit)
        rms = _rms_px(board, [views[i] for i in used], *fit)
    chosen = [views[i] for i in used]
    if float(np.sqrt(np.mean(rms**2))) > MAX_RMS_PX:
        raise BadCalibrationSet(_contradiction(rms))
    scale = _scale(board, chosen, *fit)
    if abs(scale - 1) > MAX_SCALE_ERROR:
        raise BadCalibrationSet(
            f"the board's squares seem to measure {scale * board.square * 1e3:.2f} mm, not "
            f"{board.square * 1e3:.2f} mm; measure the printed board over several squares and set "
            "board.square and board.marker, or correct the camera's focal length"
        )
    T_base_camera, T_tcp_board = fit
    translation, rotation = _residuals(chosen, [seen[i] for i in used], T_base_camera, T_tcp_board)
    halves = [_fit(board, chosen[k::2], *fit)[0] for k in (0, 1)]
    looked_at = np.mean([(view.T_base_tcp @ T_tcp_board).position for view in chosen], axis=0)
    apart = [half.apply(T_base_camera.inverse().apply(looked_at)) for half in halves]
    half_translation_m = float(np.linalg.norm(apart[0] - apart[1]))
    if len(used) >= _COMPARABLE and half_translation_m > MAX_HALF_M:
        raise BadCalibrationSet(
            "the calibration does not repeat: two halves of the pictures place the board "
            f"{half_translation_m * 1e3:.1f} mm apart, at most {MAX_HALF_M * 1e3:g} mm are allowed; "
            f"{_SLIPPED}"
        )
    return HandEye(
        T_base_camera=T_base_camera,
        T_tcp_board=T_tcp_board,
        used=used,
        rms_px=rms,
        translation_m=translation,
        rotation_rad=rotation,
        half_translation_m=half_translation_m,
        half_rotation_rad=pose_distance(halves[0], halves[1])[1],
        scale=scale,
    )


def spread(poses: Sequence[Pose]) -> np.ndarray:
    """(3,) RMS of the turns about the three principal axes of their spread, largest first, radians."""
    turns = Rotation.from_quat(np.stack([pose.quat_wxyz for pose in poses]), scalar_first=True)
    vectors = (turns.mean().inv() * turns).as_rotvec()
    return np.linalg.svd(vectors - vectors.mean(0), compute_uv=False) / np.sqrt(len(poses))


# ---------------------------------------------------------------------- refusals


def _refuse_flat(hands: Sequence[Pose], *, n_rejected: int = 0) -> None:
    second = float(spread(hands)[1])
    if second < MIN_SPREAD_RAD:
        where, remedy = "", "tilt the board in different directions (--tilt-deg) and by more"
        if n_rejected:
            where = f" in the {len(hands)} pictures that agree ({n_rejected} contradict them)"
            remedy = _SLIPPED
        raise BadCalibrationSet(
            f"the hand turned by {np.degrees(second):.1f} degrees (RMS) about its second axis{where}, at "
            f"least {np.degrees(MIN_SPREAD_RAD):.0f} are needed; {remedy}"
        )


def _refuse_small(board: Board, views: Sequence[View], usable: list[int]) -> None:
    sizes = [size for view in views if (size := square_px(view.corners, board)) > 0]
    if sizes and len(usable) >= MIN_VIEWS and np.median(sizes) < MIN_SQUARE_PX:
        raise BadCalibrationSet(
            f"a square of the board is {np.median(sizes):.1f} pixels wide in the image, at least "
            f"{MIN_SQUARE_PX:.0f} are needed; bring the board nearer to the camera or print a larger one"
        )


def _contradiction(rms: np.ndarray) -> str:
    return (
        f"the views contradict each other: corners are {np.sqrt(np.mean(rms**2)):.1f} pixels (RMS) from "
        f"where they should be, at most {MAX_RMS_PX:g} are allowed; clamp the board so that it cannot slip "
        "in the hand, keep it flat, and check the camera's intrinsics"
    )


# ---------------------------------------------------------------------- solving


def _closed_form(hands: Sequence[Pose], boards: Sequence[Pose]) -> tuple[Pose, Pose]:
    """``T_base_camera`` and ``T_tcp_board``; OpenCV solves eye-in-hand, so the arm's poses go in inverted."""
    inverted = [hand.inverse().as_matrix() for hand in hands]
    targets = [pose.as_matrix() for pose in boards]
    turn, shift = cv2.calibrateHandEye(
        [matrix[:3, :3] for matrix in inverted],
        [matrix[:3, 3] for matrix in inverted],
        [matrix[:3, :3] for matrix in targets],
        [matrix[:3, 3] for matrix in targets],
        method=cv2.CALIB_HAND_EYE_PARK,
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, np.ravel(shift)
    if not np.isfinite(matrix).all():
        raise BadCalibrationSet(
            "the poses do not determine the camera's place; tilt the board in different directions "
            "(--tilt-deg)"
        )
    camera = Pose.from_matrix(matrix)
    held = [hand.inverse() @ camera @ seen for hand, seen in zip(hands, boards, strict=True)]
    turns = Rotation.from_quat(np.stack([pose.quat_wxyz for pose in held]), scalar_first=True)
    middle = Pose(
        position=np.median([pose.position for pose in held], axis=0),
        quat_wxyz=turns.mean().as_quat(scalar_first=True),
    )
    return camera, middle


def _fit(board: Board, views: Sequence[View], camera: Pose, held: Pose) -> tuple[Pose, Pose]:
    def residuals(step: np.ndarray) -> np.ndarray:
        errors = _errors(board, views, _moved(camera, step[:6]), _moved(held, step[6:]))
        return np.concatenate(errors).ravel()

    found = least_squares(residuals, np.zeros(12), loss="soft_l1", f_scale=_LOSS_PX, x_scale=1e-2)
    return _moved(camera, found.x[:6]), _moved(held, found.x[6:])


def _scale(board: Board, views: Sequence[View], camera: Pose, held: Pose) -> float:
    def residuals(step: np.ndarray) -> np.ndarray:
        moved = _moved(camera, step[:6]), _moved(held, step[6:12])
        return np.concatenate(_errors(board, views, *moved, scale=1 + step[12])).ravel()

    found = least_squares(residuals, np.zeros(13), loss="soft_l1", f_scale=_LOSS_PX, x_scale=1e-2)
    return 1 + float(found.x[12])


def _errors(
    board: Board, views: Sequence[View], camera: Pose, held: Pose, scale: float = 1.0
) -> list[np.ndarray]:
    """(k, 2) pixels for each view: where its corners should be, less where they were found."""
    corners = board.corners() * scale
    camera_base = camera.inverse()
    return [
        project(
            (camera_base @ view.T_base_tcp @ held).apply(corners[view.corners.ids]), view.intrinsics
        )
        - view.corners.pixels
        for view in views
    ]  # fmt: skip


def _rms_px(board: Board, views: Sequence[View], camera: Pose, held: Pose) -> np.ndarray:
    errors = _errors(board, views, camera, held)
    return np.array([np.sqrt(np.mean(np.sum(error**2, axis=1))) for error in errors])


def _residuals(
    views: Sequence[View], seen: Sequence[Pose | None], camera: Pose, held: Pose
) -> tuple[np.ndarray, np.ndarray]:
    """Distance and angle between the board as each view alone sees it and as the hand holds it."""
    translation, rotation = np.empty(len(views)), np.empty(len(views))
    for i, (view, pose) in enumerate(zip(views, seen, strict=True)):
        assert pose is not None
        from_camera, from_hand = camera @ pose, view.T_base_tcp @ held
        translation[i], rotation[i] = pose_distance(from_camera, from_hand)
    return translation, rotation


def _moved(pose: Pose, step: np.ndarray) -> Pose:
    """A pose moved by (6,) metres and a rotation vector, in its own reference frame."""
    turn = Rotation.from_rotvec(step[3:]) * Rotation.from_quat(pose.quat_wxyz, scalar_first=True)
    return Pose(position=pose.position + step[:3], quat_wxyz=turn.as_quat(scalar_first=True))
