"""Run of a hand-eye calibration: pictures of the board, solution, report."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import numpy as np

from hal.calibrate.board_print import print_board
from hal.calibrate.board_views import (
    Picture,
    picture_paths,
    read_picture,
    refuse_invisible,
    take_pictures,
    write_picture,
)
from hal.calibrate.config import CalibrateConfig
from hal.calibrate.hand_eye import BadCalibrationSet, solve_hand_eye
from hal.calibrate.report import (
    DepthOffset,
    depth_offset,
    describe,
    describe_table,
    draw_corners,
    draw_residuals,
)
from hal.camera_calibration import Calibration, calibration_path, write_calibration
from hal.cell import Cell, Workspace
from hal.charuco import Board
from hal.errors import OutOfWorkspace
from hal.open_cell import cell_from_values, cell_from_yaml
from hal.operator import Operator, StoppedByOperator
from hal.table import fit_table
from mskgrasp.core.config import check_config, read_config, read_yaml, write_config
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.options import parse
from mskgrasp.runtime.progress import note

DESCRIPTION = """Estimates the pose of the camera over the table with a ChArUco board held by the gripper.

Print the board with --print-board board.pdf. The arm closes its fingers on the board, shows it to the camera
from many sides, and brings it back; keep a hand on the emergency stop. Ctrl-C stops the arm, and the pictures
taken so far can be solved with --from FOLDER. Writes calibration.yaml, corners.png, residuals.png and the
pictures into --out: by default the folder of --from, without that out/calibration. See docs/calibration.md.

python -m hal.calibrate --print-board board.pdf

python -m hal.calibrate --cell configs/cells/panda_kinect2.yaml"""

_MARGIN = 0.01
"""White paper around the simulated board, metres."""
_PLATE = 0.02
"""Distance of the pads on the handle of the simulated board, metres."""


def capture(config: CalibrateConfig, cell_file: Path) -> Workspace:
    """Take the pictures into ``config.folder``.

    Returns:
        The cell's workspace.

    Raises:
        UsageError, BadConfig: The folder is in use, or the cell file is not valid.
        HalError: Arm or camera failed, or the board was not seen.
        StoppedByOperator: The operator ended the program.
    """
    if picture_paths(config.folder):
        raise UsageError(
            f"{config.folder} holds the pictures of an earlier run; solve them with --from {config.folder}, "
            "or choose another --out"
        )
    values = read_yaml(cell_file)
    cell = cell_from_values(_with_camera_at(values, config, cell_file), cell_file)
    if cell.recorded:
        raise UsageError(
            f"{cell_file}: a recording cannot be calibrated; solve the pictures of that calibration again "
            "with --from FOLDER"
        )
    if cell.arm.simulated and cell.board_holder is None:
        raise UsageError(f"{cell_file}: nothing draws a board in this simulated cell; type: sapien does")
    operator = Operator(cell)
    write_config(config.board, config.folder / "board.yaml")

    def keep(index: int, picture: Picture, n_corners: int) -> None:
        write_picture(config.folder / f"pose-{index:03d}.npz", picture)
        print(f"picture {index:3d}: {n_corners} of {config.board.n_corners} corners", flush=True)

    with cell.connected():
        write_picture(config.folder / "table.npz", Picture.of(cell.camera.capture(), cell.arm.state()))
        _take_board(cell, config, operator)
        take_pictures(
            cell,
            config.board,
            config.T_tcp_board(),
            n=config.poses,
            tilt_rad=np.radians(config.tilt_deg),
            nearest=config.nearest,
            speed=config.speed,
            settle_s=config.settle_s,
            rng=np.random.default_rng(config.seed),
            keep=keep,
        )
        try:
            operator.wait_for("Take hold of the board; Enter: the fingers open, q to stop: ")
        except StoppedByOperator as error:
            raise StoppedByOperator(
                "stopped by the operator, the board in the hand; solve the pictures with --from "
                f"{config.folder}"
            ) from error
        if operator.asks:
            cell.arm.open_gripper()
    return cell.workspace


def solve(config: CalibrateConfig, folder: Path, board: Board, workspace: Workspace | None) -> list[str]:
    """Solve from the pictures in a folder, write calibration and pictures into ``config.folder``.

    Returns:
        The result, line by line.

    Raises:
        BadCalibrationSet: The pictures do not determine the camera's pose.
        UsageError: There are no pictures, they are damaged, or from several cameras.
    """
    paths = picture_paths(folder)
    if not paths:
        raise UsageError(
            f"{folder} holds no pictures (pose-*.npz); take them with --cell FILE --out {folder}"
        )
    pictures = [read_picture(path) for path in paths]
    serials = sorted({picture.serial for picture in pictures})
    if len(serials) > 1:
        raise UsageError(
            f"{folder} holds pictures of several cameras: {', '.join(serials)}; keep those of one"
        )
    n_infrared = sum(picture.infrared is not None for picture in pictures)
    if 0 < n_infrared < len(pictures):
        raise UsageError(
            f"{folder} holds {n_infrared} pictures with and {len(pictures) - n_infrared} without an infrared "
            "image; keep those of one kind"
        )
    views = [picture.view(board) for picture in pictures]
    try:
        found = solve_hand_eye(board, views)
    except BadCalibrationSet:
        draw_corners(board, pictures, views, None, config.folder / "corners.png")
        refuse_invisible(board, pictures)
        raise
    offset = depth_offset(board, pictures, found)
    calibration = Calibration(
        serial=serials[0],
        T_base_camera=found.T_base_camera,
        intrinsics=pictures[0].intrinsics,
        rms_translation_m=found.rms_translation_m,
        rms_rotation_rad=found.rms_rotation_rad,
        n_poses=len(found.used),
        made=_now(),
    )
    write_calibration(config.folder / "calibration.yaml", calibration)
    draw_corners(board, pictures, views, found, config.folder / "corners.png")
    draw_residuals(views, found, config.folder / "residuals.png")
    lines = describe(found, views, pictures[0].T_base_camera, offset)
    return lines + _describe_table(folder, found.T_base_camera, offset, workspace)


def _describe_table(
    folder: Path, T_base_camera: Pose, offset: DepthOffset | None, workspace: Workspace | None
) -> list[str]:
    path = folder / "table.npz"
    if workspace is None or not path.is_file():
        return []
    picture = read_picture(path)
    plane = fit_table(picture.depth, picture.intrinsics, T_base_camera, workspace.region, workspace.table_z)
    return [describe_table(plane, offset, workspace.table_z)]


def _with_camera_at(values: dict[str, Any], config: CalibrateConfig, cell_file: Path) -> dict[str, Any]:
    """The cell's values with a camera measured by tape in place of a calibration file."""
    camera = values.get("camera")
    stated = camera.get("calibration") if isinstance(camera, dict) else None
    if not isinstance(stated, str):
        if config.camera_at is None:
            return values
        cell_from_values(values, cell_file)  # faults of the file itself are reported first
        raise UsageError(
            f"--camera-at is for a camera with a calibration file; that of {cell_file} knows where it is"
        )
    if config.camera_at is None:
        if not calibration_path(stated, cell_file).is_file():
            raise UsageError(
                f"{cell_file}: there is no calibration file {stated} yet; measure with a tape "
                "where the camera is and give it as --camera-at X Y Z (base frame, m), good to 3 cm; if it "
                "does not look straight down, add --camera-towards X Y Z, what is in the middle of its image"
            )
        return values
    by_hand = Calibration(
        serial="any",
        T_base_camera=config.T_base_camera(),
        intrinsics=None,
        rms_translation_m=0.03,
        rms_rotation_rad=0.1,
        n_poses=0,
        made=_now(),
    )
    path = config.folder.absolute() / "by_hand.yaml"
    write_calibration(path, by_hand)
    return {**values, "camera": {**values["camera"], "calibration": str(path)}}


def _take_board(cell: Cell, config: CalibrateConfig, operator: Operator) -> None:
    board, arm = config.board, cell.arm
    if cell.board_holder is not None:
        arm.move_gripper(_PLATE)
        width, height = (edge + 2 * _MARGIN for edge in board.size)
        cell.board_holder.hold_board(board.image(80, _MARGIN), (width, height), config.T_tcp_board())
        return
    try:
        arm.check_pose(arm.state().T_base_tcp)
    except OutOfWorkspace as error:
        raise OutOfWorkspace(
            f"the hand could not return here to give the board back: {error}; guide it by hand to over the "
            "region"
        ) from error
    held = "" if arm.in_hand() is None else "The hand holds something: take hold of it. "
    operator.wait_for(f"{held}Enter: the fingers open, q to stop: ")
    arm.open_gripper()
    operator.wait_for(
        "Hold the board's handle between the fingers, printed side up; Enter: the fingers close, q to stop: "
    )
    if not arm.grasp(cell.workspace.grasp_force).holding:
        raise BadCalibrationSet(
            "the fingers closed on nothing; hold the board's handle between them, start again"
        )
    operator.wait_for("Step back, a hand on the emergency stop; Enter: the arm moves, q to stop: ")


def _stored_board(path: Path, given: Board) -> Board:
    """The board that pictures were taken of; an option takes precedence unless it states the default.

    Whether an option that states the default was given is not known; a line says what is used instead.

    Raises:
        BadConfig: The file is not valid, or not with these options.
    """
    stored, usual = read_config(Board, path).model_dump(), Board().model_dump()
    changed = {key: value for key, value in given.model_dump().items() if value != usual[key]}
    kept = {key: value for key, value in stored.items() if key not in changed and value != usual[key]}
    if kept or any(stored[key] != value for key, value in changed.items()):
        here = f"{_listed(changed)}, else " if changed else ""
        there = f" ({_listed(kept)}; to use a default instead, change that file)" if kept else ""
        note(f"board: {here}as in {path}{there}")
    return check_config(Board, stored | changed, f"{path} with --board")


def _listed(values: dict[str, Any]) -> str:
    return ", ".join(f"{key} {value}" for key, value in values.items())


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def main() -> int:
    """Take pictures, solve, report."""
    config = parse(CalibrateConfig, prog="python -m hal.calibrate", description=DESCRIPTION)
    board, folder = config.board, config.folder
    if config.print_board is not None:
        make_folder(config.print_board.parent)
        paper = print_board(board, config.print_board)
        print(
            f"wrote {config.print_board} ({paper}); print it at 100 %, measure it, glue it on a stiff plate"
        )
        return 0
    if config.cell is None and config.source is None:
        raise UsageError(
            "give --cell FILE (take pictures and solve), --from FOLDER (solve), or --print-board FILE"
        )
    if config.folder != config.source:
        make_folder(config.folder)
    if config.source is not None:
        folder = config.source
        if (folder / "board.yaml").is_file():
            board = _stored_board(folder / "board.yaml", board)
        workspace = None if config.cell is None else cell_from_yaml(config.cell).workspace
    else:
        assert config.cell is not None
        workspace = capture(config, config.cell)
    for line in solve(config, folder, board, workspace):
        print(line)
    print(f"wrote calibration.yaml, corners.png and residuals.png in {config.folder}; look at both pictures,")
    print("then, for a real cell, copy calibration.yaml to where camera.calibration of its file points; if")
    print("the line 'depth' states a correction, add it to camera.depth_offset of that file")
    return 0
