"""Reading of recordings, and refusals."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from hal.errors import BadRecording
from hal.replay import read_recording, recorded_cell
from tests.hal.replay.toy import ToyCamera, toy_cell


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.unlink(), "there is no recording"),
        (lambda path: path.write_text("frames: 3"), "damaged or no recording"),
        (lambda path: os.truncate(path, 2000), "damaged or no recording"),
        (lambda path: h5py.File(path, "w").close(), "is no recording of a cell"),
        (lambda path: change(path, lambda f: f.attrs.update(schema=7)), "has schema 7, this version reads 1"),
        (lambda path: change(path, lambda f: f.__delitem__("frames")), "frame 0 is missing"),
        (lambda path: change(path, lambda f: f["frames/depth"].resize(2, 0)), "expected"),
        (lambda path: change_event(path, error=[]), "damaged or no recording"),
        (lambda path: change_event(path, arguments=None), "the arguments of capture are None"),
        (lambda path: change_event(path, result=[[]]), "damaged or no recording"),
        (lambda path: change_event(path, "state", result={}), "damaged or no recording ('joints')"),
        (lambda path: change_event(path, "state", result=None), "damaged or no recording"),
        (lambda path: change_event(path, "grasp", result={"width": 0.03}), "damaged or no recording"),
        (lambda path: change_event(path, "grasp", after={"joints": []}), "damaged or no recording"),
        (lambda path: change_event(path, "part_pose", result=[0.4, 0.1]), "a pose is [0.4, 0.1], not x y z"),
    ],
)
def test_a_wrong_file_is_one_line(recording: Path, tmp_path: Path, spoil, message: str):
    path = tmp_path / "run.h5"
    path.write_bytes(recording.read_bytes())
    spoil(path)
    with pytest.raises(BadRecording) as caught:
        read_recording(path)
    assert message in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def change_event(path: Path, call: str = "capture", **changes) -> None:
    def spoil(file: h5py.File) -> None:
        events = [json.loads(text) for text in file["events"].asstr()[:]]
        next(one for one in events if one["call"] == call).update(changes)
        file["events"][:] = [json.dumps(one) for one in events]

    change(path, spoil)


def change(path: Path, how) -> None:
    with h5py.File(path, "r+") as file:
        how(file)


def test_fine_colour_and_infrared_are_recorded_where_the_camera_has_them(recording: Path, tmp_path: Path):
    path = tmp_path / "fine.h5"
    fine_cell = dataclasses.replace(toy_cell(), camera=ToyCamera(fine=True))
    with recorded_cell(fine_cell, path).connected() as cell:
        for _ in range(2):
            cell.camera.capture()
    frame = read_recording(path).frame(1, 0.0)
    assert frame.fine_colour is not None and frame.infrared is not None
    assert frame.fine_colour.shape == (8, 12, 3) and (frame.fine_colour == 20).all()
    assert frame.infrared.dtype == np.uint16 and (frame.infrared == 2000).all()
    without = read_recording(recording).frame(1, 0.0)
    assert without.fine_colour is None and without.infrared is None
    change(path, lambda file: file["frames"].move("infrared", "seen"))
    change(path, lambda file: file["frames"].create_dataset("infrared", (2, 4, 5), np.uint16))
    with pytest.raises(BadRecording, match=r"frames/infrared is \(2, 4, 5\), expected \(2, 4, 6\)"):
        read_recording(path)
