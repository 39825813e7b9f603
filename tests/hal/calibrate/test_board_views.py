"""Pictures of the board in the hand, taken by a camera that draws it, and their files."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal import Cell
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
from hal.errors import MotionAborted, OutOfWorkspace
from mskgrasp.core.errors import UsageError
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from tests.hal.calibrate.toy_bench import BOARD, HELD, OVERHEAD, bench

N = 8


def take(cell: Cell, **changes: Any) -> tuple[int, list[tuple[int, Picture, int]]]:
    kept: list[tuple[int, Picture, int]] = []
    settings: dict[str, Any] = dict(
        n=N, tilt_rad=np.radians(30), nearest=0.5, speed=0.2, settle_s=0.1, rng=np.random.default_rng(0),
        keep=lambda *one: kept.append(one),
    )  # fmt: skip
    return take_pictures(cell, BOARD, HELD, **(settings | changes)), kept


@pytest.fixture(scope="module")
def taken() -> list[tuple[int, Picture, int]]:
    return take(bench())[1]


def test_as_many_pictures_as_asked_for_are_taken_and_the_hand_returns():
    cell = bench()
    start = cell.arm.state().T_base_tcp
    n_taken, kept = take(cell)
    found = [n_corners for _, _, n_corners in kept]
    assert sum(n >= 6 for n in found) == N and n_taken == len(kept) < 2 * N
    assert [number for number, _, _ in kept] == list(range(n_taken))
    assert pose_distance(cell.arm.state().T_base_tcp, start) == pytest.approx((0, 0), abs=1e-6)


def test_an_arm_that_turns_in_place_first_keeps_the_board_off_the_table(monkeypatch: pytest.MonkeyPatch):
    cell = bench()
    low = Pose(position=np.array([0.5, 0.0, 0.06]), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))
    cell.arm.move_to_pose(low)
    went: list[float] = []
    move = cell.arm._move_to_pose

    def legs(goal: Pose) -> list[Pose]:
        here = cell.arm._state().T_base_tcp
        return [Pose(position=here.position, quat_wxyz=goal.quat_wxyz), goal]

    def moved(goal: Pose, speed: float) -> None:
        line = straight_line(cell.arm._state().T_base_tcp, goal, np.linspace(0, 1, 21))
        went.extend((line[k] @ HELD).apply(BOARD.outline())[:, 2].min() for k in range(21))
        move(goal, speed)

    monkeypatch.setattr(cell.arm, "_legs", legs)
    monkeypatch.setattr(cell.arm, "_move_to_pose", moved)
    n_taken, _ = take(cell, n=24)
    assert n_taken >= 24 and min(went) > 0.015


def test_the_pictures_give_the_camera(taken: list[tuple[int, Picture, int]]):
    """The camera drew the board by a homography; the solver never saw where from."""
    found = solve_hand_eye(BOARD, [picture.view(BOARD) for _, picture, _ in taken])
    distance, angle = pose_distance(found.T_base_camera, OVERHEAD)
    assert distance < 3e-3 and np.degrees(angle) < 0.3


def test_a_board_that_is_not_there_ends_after_five_pictures_and_the_hand_returns():
    cell = bench(empty=True)
    start = cell.arm.state().T_base_tcp
    with pytest.raises(BadCalibrationSet, match="not found in any of the first 5 pictures"):
        take(cell)
    assert pose_distance(cell.arm.state().T_base_tcp, start) == pytest.approx((0, 0), abs=1e-6)


@pytest.mark.parametrize(
    ("empty", "ink", "message"),
    [
        (True, "laser", "not found in any of the first 5 infrared images"),
        (False, "inkjet", r"found in colour in \d of 5 pictures, but in no infrared image, .* laser printer"),
    ],
)
def test_an_infrared_stream_without_a_board_ends_in_one_line(empty: bool, ink: str, message: str):
    cell = bench(empty=empty, ink=ink)
    start = cell.arm.state().T_base_tcp
    with pytest.raises(BadCalibrationSet, match=message) as caught:
        take(cell)
    assert "\n" not in str(caught.value)
    assert pose_distance(cell.arm.state().T_base_tcp, start) == pytest.approx((0, 0), abs=1e-6)


def test_the_board_is_sought_in_infrared_where_there_is_any(taken: list[tuple[int, Picture, int]]):
    (_, picture, n_corners), *_ = take(bench(ink="laser"))[1]
    assert n_corners >= 6 and len(picture.view(BOARD).corners.ids) == n_corners
    blank = dataclasses.replace(picture, colour=np.zeros_like(picture.colour))
    assert len(blank.view(BOARD).corners.ids) == n_corners
    dark = dataclasses.replace(picture, infrared=np.zeros_like(picture.depth, np.uint16))
    assert len(dark.view(BOARD).corners.ids) == 0
    refuse_invisible(BOARD, [picture, dark])  # one was found
    refuse_invisible(BOARD, [one for _, one, _ in taken])  # no infrared at all
    with pytest.raises(BadCalibrationSet, match="in colour in 2 of 2 pictures"):
        refuse_invisible(BOARD, [dark, dark])


def test_a_camera_that_does_not_look_straight_down_is_found(monkeypatch: pytest.MonkeyPatch):
    """It is said to be 3 cm and some degrees from where it is."""
    true = CalibrateConfig(camera_at=(0.15, 0.2, 0.95), camera_towards=(0.5, 0.0, 0.2)).T_base_camera()
    rough = CalibrateConfig(camera_at=(0.17, 0.18, 0.96), camera_towards=(0.53, 0.02, 0.2)).T_base_camera()
    cell = bench(pose=true)
    capture = cell.camera.capture
    monkeypatch.setattr(
        cell.camera, "capture", lambda *a: dataclasses.replace(capture(*a), T_base_camera=rough)
    )
    _, kept = take(cell)
    found = solve_hand_eye(BOARD, [picture.view(BOARD) for _, picture, _ in kept])
    distance, angle = pose_distance(found.T_base_camera, true)
    assert distance < 3e-3 and np.degrees(angle) < 0.3


def test_a_board_that_cannot_be_brought_back_straight_is_taken_where_it_is(monkeypatch: pytest.MonkeyPatch):
    cell = bench()
    start, move = cell.arm.state().T_base_tcp, cell.arm.move_to_pose

    def refuse_the_way_back(pose: Pose, *, speed: float) -> None:
        if pose_distance(pose, start) == (0, 0):
            raise OutOfWorkspace("no straight line from here")
        move(pose, speed=speed)

    monkeypatch.setattr(cell.arm, "move_to_pose", refuse_the_way_back)
    n_taken, _ = take(cell)
    assert n_taken >= N


def test_an_arm_that_reaches_too_few_poses_says_so(monkeypatch):
    cell = bench()
    reached: list[tuple[float, ...]] = []

    def check(pose: Pose) -> None:
        place = tuple(pose.position)
        if place not in reached:
            if len(reached) == 3:
                raise OutOfWorkspace("out of reach")
            reached.append(place)

    monkeypatch.setattr(cell.arm, "check_pose", check)
    with pytest.raises(BadCalibrationSet, match="the camera 3 times and it was found 3 times, at least 8"):
        take(cell)


def test_an_arm_that_never_rests_is_an_error(monkeypatch):
    """Half a millimetre between two looks."""
    cell = bench()
    state, drift = cell.arm.state, itertools.count()

    def drifting() -> Any:
        now = state()
        off = np.array([5e-4 * next(drift), 0, 0])
        moved = Pose(position=now.T_base_tcp.position + off, quat_wxyz=now.T_base_tcp.quat_wxyz)
        return type(now)(**{**vars(now), "T_base_tcp": moved})

    monkeypatch.setattr(cell.arm, "state", drifting)
    with pytest.raises(MotionAborted, match="does not come to rest; raise --settle-s"):
        take(cell)


def test_a_picture_survives_its_file_to_the_bit(taken: list[tuple[int, Picture, int]], tmp_path: Path):
    picture = taken[0][1]
    write_picture(tmp_path / "pose-000.npz", picture)
    read = read_picture(tmp_path / "pose-000.npz")
    for name in ("colour", "depth", "intrinsics"):
        one, other = getattr(picture, name), getattr(read, name)
        assert one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    for name in ("T_base_camera", "T_base_tcp"):
        assert np.array_equal(getattr(picture, name).as_vector(), getattr(read, name).as_vector())
    assert read.serial == "toy" and read.infrared is None
    assert [path.name for path in tmp_path.iterdir()] == ["pose-000.npz"]
    infrared = np.arange(picture.depth.size).reshape(picture.depth.shape).astype(np.uint16)
    write_picture(tmp_path / "pose-000.npz", dataclasses.replace(picture, infrared=infrared))
    again = read_picture(tmp_path / "pose-000.npz").infrared
    assert again is not None and again.dtype == np.uint16 and np.array_equal(again, infrared)


def test_pictures_are_listed_in_the_order_in_which_they_were_taken(tmp_path: Path):
    for name in ("pose-010.npz", "pose-002.npz", "table.npz", "pose-001.npz.tmp", "pose-000.npz"):
        (tmp_path / name).touch()
    assert [path.name for path in picture_paths(tmp_path)] == ["pose-000.npz", "pose-002.npz", "pose-010.npz"]


@pytest.mark.parametrize("spoil", ["cut", "emptied", "text", "missing", "no pose", "pickle"])
def test_a_file_that_is_no_picture_is_one_line(
    taken: list[tuple[int, Picture, int]], tmp_path: Path, spoil: str
):
    path = tmp_path / "pose-003.npz"
    write_picture(path, taken[0][1])
    whole = path.read_bytes()
    match spoil:
        case "cut":
            path.write_bytes(whole[: len(whole) // 2])
        case "emptied":
            path.write_bytes(b"")
        case "text":
            path.write_text("a picture")
        case "missing":
            path.unlink()
        case "no pose":
            np.savez(path, colour=np.zeros((4, 4, 3), np.uint8))
        case _:
            np.savez(path, colour=np.array([{}], dtype=object))
    with pytest.raises(UsageError, match=r"pose-003.npz cannot be read as a picture \(\w+\)") as caught:
        read_picture(path)
    assert "\n" not in str(caught.value)
