"""Pictures of the board in the hand: capture, storage and reading."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hal.arm_state import ArmState
from hal.calibrate.board_poses import Sight, candidate_poses, way_is_clear
from hal.calibrate.hand_eye import MIN_VIEWS, BadCalibrationSet, View
from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.charuco import MIN_CORNERS, Board, detect, infrared_grey
from hal.errors import MotionAborted, OutOfWorkspace
from mskgrasp.core.array_files import read_arrays, write_arrays
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose, pose_distance

_STILL_M = 3e-4
_STILL_RAD = 1e-3
_HOPELESS = 5
_SPARE = 2


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One frame and the pose of the hand.

    Attributes:
        colour: (h, w, 3) uint8, RGB.
        depth: (h, w) float32, metres, NaN where invalid.
        intrinsics: (3, 3) pixels.
        T_base_camera: Pose of the camera's optical frame in the base, as configured at the time.
        T_base_tcp: Measured pose of the TCP in the base.
        serial: Serial number of the camera.
        infrared: (h, w) uint16, or None if the camera provides none.
    """

    colour: np.ndarray
    depth: np.ndarray
    intrinsics: np.ndarray
    T_base_camera: Pose
    T_base_tcp: Pose
    serial: str
    infrared: np.ndarray | None = None

    @property
    def sighted(self) -> np.ndarray:
        """(h, w, 3) uint8 in which the board is detected: infrared, which shares depth's optics, if any."""
        if self.infrared is None:
            return self.colour
        return np.repeat(infrared_grey(self.infrared)[..., None], 3, axis=2)

    @classmethod
    def of(cls, frame: RgbdFrame, state: ArmState) -> Picture:
        """The picture of a frame and a state."""
        return cls(
            colour=frame.colour,
            depth=frame.depth,
            intrinsics=frame.intrinsics,
            T_base_camera=frame.T_base_camera,
            T_base_tcp=state.T_base_tcp,
            serial=frame.serial,
            infrared=frame.infrared,
        )

    def view(self, board: Board) -> View:
        """Detect the board in the picture."""
        return View(
            T_base_tcp=self.T_base_tcp, corners=detect(board, self.sighted), intrinsics=self.intrinsics
        )


def refuse_invisible(board: Board, pictures: Sequence[Picture]) -> None:
    """Refuse pictures in which the board is seen in colour and not in infrared.

    Raises:
        BadCalibrationSet: The board's print does not absorb infrared light.
    """
    with_infrared = [picture for picture in pictures if picture.infrared is not None]
    in_infrared, in_colour = (
        sum(len(detect(board, image).ids) >= MIN_CORNERS for image in images)
        for images in ([one.sighted for one in with_infrared], [one.colour for one in with_infrared])
    )
    if in_colour > 0 and in_infrared == 0:
        raise BadCalibrationSet(
            f"the board was found in colour in {in_colour} of {len(pictures)} pictures, but in no infrared "
            "image, on which the camera is calibrated; print it with a laser printer (the ink of many inkjet "
            "printers is invisible in infrared), and keep sunlight off"
        )


def take_pictures(
    cell: Cell,
    board: Board,
    T_tcp_board: Pose,
    *,
    n: int,
    tilt_rad: float,
    nearest: float,
    speed: float,
    settle_s: float,
    rng: np.random.Generator,
    keep: Callable[[int, Picture, int], None],
) -> int:
    """Move the board before the camera, take pictures, and return the hand.

    Args:
        cell: Connected, the board in the hand.
        board: Board in the hand.
        T_tcp_board: Approximate pose of the board in the tcp frame, to 1 or 2 cm.
        n: Number of pictures in which the board is to be found.
        tilt_rad: Greatest tilt of the board against the line of sight, radians.
        nearest: Least distance of the board from the camera, metres.
        speed: Speed of the hand, m/s.
        settle_s: Rest before each picture, seconds.
        rng: Random generator of the poses.
        keep: Called with the number of the picture, the picture, and its number of detected corners.

    Returns:
        Number of pictures taken.

    Raises:
        BadCalibrationSet: The board is not found, or too few poses can be reached.
        HalError: Arm or camera failed.
    """
    arm = cell.arm
    start = arm.state().T_base_tcp
    frame = cell.camera.capture()
    sight = Sight(
        T_base_camera=frame.T_base_camera,
        intrinsics=frame.intrinsics,
        width=frame.depth.shape[1],
        height=frame.depth.shape[0],
        nearest=nearest,
    )
    table_z = cell.workspace.table_z
    targets = candidate_poses(
        board, T_tcp_board, sight, table_z, tilt_rad=tilt_rad, rng=rng, possible=_possible(cell)
    )
    taken = found = 0
    first: list[Picture] = []

    def clear(target: Pose) -> bool:
        # As the arm gets there, which may be by a turn in place: low over the table the board has no room.
        stops = [arm.state().T_base_tcp, *arm.legs(target)]
        return way_is_clear(stops, T_tcp_board, board, table_z)

    def bring_back() -> None:
        if not clear(start):
            return  # a person takes the board where it is
        with contextlib.suppress(OutOfWorkspace):  # no straight path there
            arm.move_to_pose(start, speed=speed)

    for target in targets:
        if not clear(target):
            continue
        try:
            arm.move_to_pose(target, speed=speed)
        except OutOfWorkspace:
            continue  # no straight path there: refused before anything moved
        arm.wait(settle_s)
        picture = _still_picture(cell)
        n_corners = len(detect(board, picture.sighted).ids)
        keep(taken, picture, n_corners)
        taken += 1
        found += n_corners >= MIN_CORNERS
        if found == 0:
            first.append(picture)
        if found == 0 and taken == _HOPELESS:
            bring_back()
            refuse_invisible(board, first)
            image = "pictures" if picture.infrared is None else "infrared images"
            raise BadCalibrationSet(
                f"the board was not found in any of the first {taken} {image} (see those in the "
                "folder); it must be this board, printed side up, held as --board-at says, and lit evenly"
            )
        if found == n or taken == _SPARE * n:
            break
    bring_back()
    if taken == 0 or found < MIN_VIEWS:
        raise BadCalibrationSet(
            f"the arm could bring the board before the camera {taken} times and it was found {found} times, "
            f"at least {MIN_VIEWS} are needed; check where the camera is said to be (--camera-at), the "
            "workspace's box, --nearest and --board-at"
        )
    return taken


def _possible(cell: Cell) -> Callable[[Pose], bool]:
    def possible(pose: Pose) -> bool:
        try:
            cell.arm.check_pose(pose)
        except OutOfWorkspace:
            return False
        return True

    return possible


def _still_picture(cell: Cell) -> Picture:
    """A frame during which the hand did not move."""
    for _ in range(3):
        before = cell.arm.state()
        frame = cell.camera.capture()
        after = cell.arm.state()
        distance, angle = pose_distance(before.T_base_tcp, after.T_base_tcp)
        if distance < _STILL_M and angle < _STILL_RAD:
            return Picture.of(frame, after)
        cell.arm.wait(0.5)
    raise MotionAborted("the arm does not come to rest; raise --settle-s, and see what pushes it")


# ---------------------------------------------------------------------- the folder


def write_picture(path: Path, picture: Picture) -> None:
    """Write a picture; the file appears whole or not at all."""
    infrared: dict[str, Any] = {} if picture.infrared is None else {"infrared": picture.infrared}
    write_arrays(
        path,
        colour=picture.colour,
        depth=picture.depth,
        intrinsics=picture.intrinsics,
        T_base_camera=picture.T_base_camera.as_vector(),
        T_base_tcp=picture.T_base_tcp.as_vector(),
        serial=np.frombuffer(picture.serial.encode(), dtype=np.uint8),
        **infrared,
    )


def read_picture(path: Path) -> Picture:
    """Read a picture.

    Raises:
        UsageError: The file is missing, damaged, or no picture.
    """
    try:
        arrays = read_arrays(path)
        return Picture(
            colour=arrays["colour"],
            depth=arrays["depth"],
            intrinsics=arrays["intrinsics"],
            T_base_camera=Pose.from_vector(arrays["T_base_camera"]),
            T_base_tcp=Pose.from_vector(arrays["T_base_tcp"]),
            serial=arrays["serial"].tobytes().decode(),
            infrared=arrays.get("infrared"),
        )
    except (OSError, ValueError, KeyError) as error:
        raise UsageError(
            f"{path} cannot be read as a picture ({type(error).__name__}); delete it, or take the "
            "pictures again"
        ) from error


def picture_paths(folder: Path) -> list[Path]:
    """The board's pictures in a folder, in the order in which they were taken."""
    return sorted(folder.glob("pose-*.npz"))
