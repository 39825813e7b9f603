"""The whole calibration in the simulated cell, where the truth is known."""

from __future__ import annotations

import dataclasses
import io
import signal
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hal import Cell
from hal.calibrate import run
from hal.calibrate.board_views import Picture, picture_paths, read_picture, take_pictures, write_picture
from hal.calibrate.config import CalibrateConfig
from hal.calibrate.hand_eye import BadCalibrationSet, HandEye, solve_hand_eye
from hal.calibrate.run import _stored_board, capture, solve
from hal.camera_calibration import read_calibration
from hal.charuco import Board
from hal.errors import OutOfWorkspace
from hal.operator import Operator, StoppedByOperator
from mskgrasp.core.config import write_config
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.core.geometry import pose_distance
from tests.hal.calibrate.toy_bench import BOARD as TOY_BOARD
from tests.hal.calibrate.toy_bench import HELD, bench
from tests.programs import run_here, running

SAPIEN = Path(__file__).parents[3] / "configs" / "cells" / "sapien.yaml"
BOARD = Board()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("calibration")
    capture(CalibrateConfig(cell=SAPIEN, out=out, poses=16, settle_s=0.1, speed=0.5), SAPIEN)
    return out


@pytest.fixture(scope="module")
def pictures(folder: Path) -> list[Picture]:
    return [read_picture(path) for path in picture_paths(folder)]


def error(found: HandEye, pictures: list[Picture]) -> tuple[float, float]:
    """mm and degrees from the simulator's truth."""
    apart, turn = pose_distance(found.T_base_camera, pictures[0].T_base_camera)
    return apart * 1e3, float(np.degrees(turn))


def test_the_camera_is_found_within_a_millimetre_and_a_tenth_of_a_degree(pictures: list[Picture]):
    found = solve_hand_eye(BOARD, [picture.view(BOARD) for picture in pictures])
    millimetres, degrees = error(found, pictures)
    assert millimetres < 1.0 and degrees < 0.1
    assert len(found.used) >= 15
    assert found.T_tcp_board.position == pytest.approx([0.16, 0, 0], abs=1e-3)


def test_with_a_cameras_noise_the_error_stays_in_millimetres(pictures: list[Picture]):
    rng = np.random.default_rng(0)
    views = []
    for picture in pictures:
        noisy = picture.colour + rng.normal(0, 2.0, picture.colour.shape)
        values = {**vars(picture), "colour": np.clip(np.rint(noisy), 0, 255).astype(np.uint8)}
        views.append(Picture(**values).view(BOARD))
    millimetres, degrees = error(solve_hand_eye(BOARD, views), pictures)
    assert millimetres < 2.0 and degrees < 0.2


@pytest.mark.slow
def test_the_pictures_can_be_solved_again_into_a_file_that_can_be_read(folder: Path, tmp_path: Path):
    for _ in range(2):
        lines = solve(CalibrateConfig(out=tmp_path), folder, BOARD, None)
    assert any(line.startswith("repeatable") for line in lines)
    calibration = read_calibration(tmp_path / "calibration.yaml", serial="sapien")
    truth = read_picture(picture_paths(folder)[0]).T_base_camera
    assert calibration.T_base_camera.position == pytest.approx(truth.position, abs=1e-3)
    assert calibration.n_poses >= 15 and not calibration.by_hand
    assert (tmp_path / "corners.png").stat().st_size > 10_000
    assert (tmp_path / "residuals.png").stat().st_size > 10_000


def test_pictures_solved_again_replace_the_calibration_in_their_own_folder_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    monkeypatch.chdir(tmp_path)
    other = tmp_path / "out" / "calibration" / "calibration.yaml"
    other.parent.mkdir(parents=True)
    other.write_text("another camera")
    (tmp_path / "mine").mkdir()
    for index, picture in enumerate(taken("laser")):
        write_picture(tmp_path / "mine" / f"pose-{index:03d}.npz", picture)
    done = run_here(run.main, "--from", "mine")
    assert done.returncode == 0 and "residuals.png in mine;" in done.stdout, done.stderr
    assert (tmp_path / "mine" / "calibration.yaml").is_file() and other.read_text() == "another camera"
    assert run_here(run.main, "--from", "nowhere").returncode == 2 and not Path("nowhere").exists()


def test_the_board_of_stored_pictures_is_theirs_but_for_what_options_state(tmp_path: Path, capsys):
    path = tmp_path / "board.yaml"
    write_config(Board(columns=7, square=0.05, marker=0.04), path)
    assert _stored_board(path, Board()) == Board(columns=7, square=0.05, marker=0.04)
    # --board.square 0.04 states the default, and is not what is used.
    assert f"board: as in {path} (columns 7, square 0.05, marker 0.04; to use" in capsys.readouterr().err
    assert _stored_board(path, Board(square=0.049)) == Board(columns=7, square=0.049, marker=0.04)
    assert f"board: square 0.049, else as in {path} (columns 7, marker 0.04;" in capsys.readouterr().err
    write_config(Board(), path)
    assert _stored_board(path, Board()) == Board()
    assert capsys.readouterr().err == ""
    write_config(Board(columns=7, square=0.05, marker=0.04), path)
    with pytest.raises(BadConfig, match="marker 0.04 m must be"):
        _stored_board(path, Board(square=0.041, marker=0.03).model_copy(update={"marker": 0.03}))


def test_a_folder_with_pictures_is_not_written_over(folder: Path):
    with pytest.raises(UsageError, match="--from"):
        capture(CalibrateConfig(cell=SAPIEN, out=folder), SAPIEN)


def test_a_damaged_picture_is_named(folder: Path, tmp_path: Path):
    whole = picture_paths(folder)[0].read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"not a picture"):
        (tmp_path / "pose-000.npz").write_bytes(content)
        with pytest.raises(UsageError, match="pose-000.npz cannot be read"):
            solve(CalibrateConfig(out=tmp_path), tmp_path, BOARD, None)


def test_pictures_with_and_without_infrared_are_not_mixed(tmp_path: Path):
    kept = taken("laser")[:2]
    write_picture(tmp_path / "pose-000.npz", kept[0])
    write_picture(tmp_path / "pose-001.npz", dataclasses.replace(kept[1], infrared=None))
    with pytest.raises(UsageError, match="holds 1 pictures with and 1 without an infrared image"):
        solve(CalibrateConfig(out=tmp_path), tmp_path, TOY_BOARD, None)


@pytest.mark.slow
def test_stored_pictures_whose_infrared_shows_no_board_name_the_print(tmp_path: Path):
    for index, picture in enumerate(taken("laser")):
        blank = dataclasses.replace(picture, infrared=np.full_like(picture.depth, 4400, np.uint16))
        write_picture(tmp_path / f"pose-{index:03d}.npz", blank)
    with pytest.raises(BadCalibrationSet, match="in no infrared image, .* print it with a laser") as caught:
        solve(CalibrateConfig(out=tmp_path), tmp_path, TOY_BOARD, None)
    assert "\n" not in str(caught.value) and (tmp_path / "corners.png").is_file()
    assert not (tmp_path / "calibration.yaml").exists()


def taken(ink: str) -> list[Picture]:
    kept: list[Picture] = []
    take_pictures(
        bench(ink=ink), TOY_BOARD, HELD, n=8, tilt_rad=0.5, nearest=0.5, speed=0.2, settle_s=0.0,
        rng=np.random.default_rng(0), keep=lambda _, picture, __: kept.append(picture),
    )  # fmt: skip
    return kept


def with_operator(monkeypatch: pytest.MonkeyPatch, cell: Cell, answers: str) -> io.StringIO:
    """The program calibrates this cell, and its operator answers this; what they are asked."""
    asked = io.StringIO()
    monkeypatch.setattr(run, "cell_from_values", lambda *_: cell)
    monkeypatch.setattr(run, "Operator", partial(Operator, answers=io.StringIO(answers), prompts=asked))
    return asked


TOY = CalibrateConfig(board=TOY_BOARD, poses=8, settle_s=0.0)


def test_an_operator_gives_the_board_and_takes_it_back(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    cell = bench()
    asked = with_operator(monkeypatch, cell, "\nno\n\n\n\n")
    start = cell.arm.state().T_base_tcp
    capture(TOY.model_copy(update={"out": tmp_path}), SAPIEN)
    assert len(picture_paths(tmp_path)) >= 8
    cell.arm.connect()
    assert pose_distance(cell.arm.state().T_base_tcp, start) == pytest.approx((0, 0), abs=1e-6)
    assert cell.arm.state().gripper_width == cell.arm.limits.gripper.stroke
    places = [asked.getvalue().index(words) for words in (
        "Enter: the fingers open, q to stop: ", "Enter: the fingers close", "'no' is no valid answer",
        "Enter: the arm moves", "Take hold of the board; Enter: the fingers open",
    )]  # fmt: skip
    assert places == sorted(places) and "The hand holds" not in asked.getvalue()


@pytest.mark.parametrize(
    ("answers", "n_pictures", "remedy"),
    [
        ("q\n", 0, "the same command goes on"),
        ("\nq\n", 0, "the same command goes on"),
        ("\n\nq\n", 0, "the same command goes on"),
        ("\n\n\nq\n", 8, "the board in the hand; solve the pictures with --from"),
    ],
)
def test_an_operator_may_stop_at_every_question(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, answers: str, n_pictures: int, remedy: str
):
    with_operator(monkeypatch, bench(), answers)
    with pytest.raises(StoppedByOperator, match=remedy):
        capture(TOY.model_copy(update={"out": tmp_path}), SAPIEN)
    assert len(picture_paths(tmp_path)) == n_pictures


def test_what_the_hand_holds_is_taken_before_the_fingers_open(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    cell = bench()
    cell.arm.grasp(20.0)
    asked = with_operator(monkeypatch, cell, "q\n")
    with pytest.raises(StoppedByOperator):
        capture(TOY.model_copy(update={"out": tmp_path}), SAPIEN)
    assert "The hand holds something: take hold of it. Enter: the fingers open" in asked.getvalue()
    cell.arm.connect()
    assert cell.arm.in_hand() is not None


def test_a_hand_that_may_not_return_where_it_stands_gets_no_board(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    cell = bench()
    cell.arm._joints[1] = 1.2  # type: ignore[attr-defined]  # guided by hand: y is 1 m at most
    asked = with_operator(monkeypatch, cell, "\n\n\n")
    with pytest.raises(
        OutOfWorkspace, match=r"to give the board back: .* outside the workspace .*; guide it by hand"
    ):
        capture(TOY.model_copy(update={"out": tmp_path}), SAPIEN)
    assert asked.getvalue() == ""


@pytest.mark.slow
def test_ctrl_c_keeps_the_pictures(tmp_path: Path):
    with running("hal.calibrate", "--cell", str(SAPIEN), "--out", str(tmp_path / "out")) as process:
        deadline = time.monotonic() + 400
        while len(picture_paths(tmp_path / "out")) < 2:
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        _, printed = process.communicate(timeout=120)
    assert process.returncode == 130 and "Ctrl-C" in printed and "Traceback" not in printed
    assert len(picture_paths(tmp_path / "out")) >= 2
