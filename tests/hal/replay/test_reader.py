"""Reading of recordings, and refusals."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import h5py
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
    ],
)
def test_a_wrong_file_is_one_line(recording: Path, tmp_path: Path, spoil, message: str):
    path = tmp_path / "run.h5"
    path.write_bytes(recording.read_bytes())
    spoil(path)
    with pytest.raises(BadRecording) as caught:
        read_recording(path)
    assert message in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def change(path: Path, how) -> None:
    with h5py.File(path, "r+") as file:
        how(file)


def test_a_fine_colour_image_is_recorded_where_the_camera_has_one(recording: Path, tmp_path: Path):
    path = tmp_path / "fine.h5"
    fine_cell = dataclasses.replace(toy_cell(), camera=ToyCamera(fine=True))
    with recorded_cell(fine_cell, path).connected() as cell:
        for _ in range(2):
            cell.camera.capture()
    fine = read_recording(path).frame(1, 0.0).fine_colour
    assert fine is not None and fine.shape == (8, 12, 3) and (fine == 20).all()
    assert read_recording(recording).frame(1, 0.0).fine_colour is None
