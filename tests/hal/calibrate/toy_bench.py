"""A toy arm that holds a board before a toy camera, which draws it where it is."""

from __future__ import annotations

import time

import numpy as np
from scipy.spatial.transform import Rotation

from hal import Camera, Cell, RgbdFrame, Workspace
from hal.charuco import Board
from mskgrasp.core.geometry import Pose
from tests.hal.board_picture import INTRINSICS, SHAPE, board_picture
from tests.hal.replay.toy import ToyArm

BOARD = Board()
OVERHEAD = Pose(
    position=np.array([0.5, 0.0, 1.0]),
    quat_wxyz=Rotation.from_matrix([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]).as_quat(scalar_first=True),
)
HELD = Pose(position=np.array([0.16, 0.0, 0.0]), quat_wxyz=np.array([1.0, 0, 0, 0]))
DEPTH_ERROR = 0.013
"""The camera measures so much too far, metres."""


def depth_of_board(T_camera_board: Pose) -> np.ndarray:
    """(h, w) float32 along the optical axis: the board's plane, everywhere."""
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(INTRINSICS).T
    normal = T_camera_board.as_matrix()[:3, 2]
    return ((normal @ T_camera_board.position) / (rays @ normal) + DEPTH_ERROR).astype(np.float32)


class BoardCamera(Camera):
    """Sees the board in the hand of an arm; nothing else is in the world.

    Args:
        arm: Holds the board.
        empty: The hand is empty.
        pose: Where the camera is.
        ink: What infrared shows of the board: "laser" print, "inkjet", which is invisible, or no image.
    """

    def __init__(self, arm: ToyArm, *, empty: bool = False, pose: Pose = OVERHEAD, ink: str | None = None):
        self._arm, self._empty, self._pose, self._ink = arm, empty, pose, ink

    def connect(self) -> None: ...
    def close(self) -> None: ...

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        T_camera_board = self._pose.inverse() @ self._arm.state().T_base_tcp @ HELD
        hidden = self._empty or T_camera_board.position[2] < 0.1
        colour = np.full((*SHAPE, 3), 110, np.uint8) if hidden else board_picture(BOARD, T_camera_board)
        printed = {"laser": colour[..., 0], "inkjet": np.full(SHAPE, 110, np.uint8)}
        return RgbdFrame(
            colour=colour,
            infrared=None if self._ink is None else 40 * printed[self._ink].astype(np.uint16),
            depth=np.full(SHAPE, np.nan, np.float32) if hidden else depth_of_board(T_camera_board),
            intrinsics=INTRINSICS,
            T_base_camera=self._pose,
            timestamp_s=time.monotonic(),
            serial="toy",
        )


def bench(*, empty: bool = False, pose: Pose = OVERHEAD, ink: str | None = None) -> Cell:
    """Connected: the arm beside the camera's view, the table at 0."""
    arm = ToyArm()
    arm.connect()
    table = Workspace(
        table_z=0.0,
        region=(0.38, 0.62, -0.12, 0.12),
        home=np.zeros(7),
        min_height=0.006,
        lift_height=0.1,
        grasp_force=20.0,
    )
    return Cell(camera=BoardCamera(arm, empty=empty, pose=pose, ink=ink), arm=arm, workspace=table)
