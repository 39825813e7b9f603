"""The file of a recording: whole or not there."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from hal.errors import NotConnected
from hal.replay import read_recording, recorded_cell
from mskgrasp.core.errors import UsageError
from tests.hal.replay.toy import ToyArm, toy_cell


def test_the_file_is_plain_hdf5_as_documented(recording: Path):
    with h5py.File(recording) as file:
        assert file.attrs["kind"] == "mskgrasp cell recording" and file.attrs["schema"] == 1
        assert file["frames/depth"].shape == (4, 4, 6) and file["frames/depth"].dtype == np.float32
        assert file["frames/colour"].dtype == np.uint8 and file["frames"].attrs["serial"] == "toy"
        events = [json.loads(text) for text in file["events"].asstr()[:]]
    assert events[0]["call"] == "present" and events[0]["arguments"] == {"part": "nut", "seed": 3}
    aborted = next(event for event in events if event["error"])
    assert aborted["error"][0] == "MotionAborted" and aborted["after"]["T_base_tcp"][2] > 0.1


def test_a_killed_program_leaves_what_happened_until_then(tmp_path: Path):
    code = (
        "import os\nfrom pathlib import Path\nfrom hal.replay import recorded_cell\n"
        "from tests.hal.replay.toy import toy_cell\n"
        f"with recorded_cell(toy_cell(), Path({str(tmp_path / 'run.h5')!r})).connected() as cell:\n"
        "    cell.camera.capture()\n    cell.arm.move_gripper(0.05)\n    os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[3])
    assert done.returncode == -signal.SIGKILL
    assert not (tmp_path / "run.h5").exists()
    found = read_recording(tmp_path / "run.h5.part")
    assert [event.call for event in found.events] == ["capture", "move_gripper"] and found.n_frames == 1
    assert found.frame(0, 0.0).depth[1, 1] == 1


def test_a_cell_that_does_not_open_leaves_no_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(_: object) -> None:
        raise NotConnected("no robot there")

    monkeypatch.setattr(ToyArm, "connect", refuse)
    with pytest.raises(NotConnected), recorded_cell(toy_cell(), tmp_path / "run.h5").connected():
        pass
    assert not list(tmp_path.iterdir())


def test_a_full_disk_ends_the_recording_with_its_name_and_keeps_it(tmp_path: Path, monkeypatch):
    out = tmp_path / "run.h5"
    with (
        pytest.raises(OSError, match="No space left on device") as raised,
        recorded_cell(toy_cell(), out).connected() as cell,
    ):
        cell.camera.capture()
        monkeypatch.setattr("mskgrasp.core.files.LEAST_FREE", 2**62)  # more than any disk has
        cell.camera.capture()
    assert raised.value.filename == f"{out}.part"
    assert read_recording(out).n_frames == 1
    with pytest.raises(UsageError, match="cannot write .*other.h5.part: No space left on device"):
        recorded_cell(toy_cell(), tmp_path / "other.h5").camera.connect()
    assert list(tmp_path.iterdir()) == [out]


def test_ctrl_c_while_a_frame_is_written_leaves_it_whole(tmp_path: Path, monkeypatch, request):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    resize = h5py.Dataset.resize

    def interrupted(dataset: h5py.Dataset, *arguments: int, **settings: int) -> None:
        resize(dataset, *arguments, **settings)
        if dataset.name in when:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(h5py.Dataset, "resize", interrupted)
    out = tmp_path / "run.h5"
    with recorded_cell(toy_cell(), out).connected() as cell:
        for when in ([], ["/frames/colour"], ["/events"]):
            if not when:
                cell.camera.capture()
                continue
            with pytest.raises(KeyboardInterrupt):
                cell.camera.capture()
    found = read_recording(out)
    assert found.n_frames == 3 and [event.result for event in found.events if not event.error] == [0, 2]


def test_a_cell_that_is_connected_twice_keeps_the_recording_of_the_first_time(tmp_path: Path):
    out = tmp_path / "run.h5"
    cell = recorded_cell(toy_cell(), out)
    with cell.connected():
        cell.camera.capture()
    for _ in range(2):
        with pytest.raises(UsageError, match="run.h5 exists already; move it away"), cell.connected():
            pass
    assert read_recording(out).n_frames == 1 and list(tmp_path.iterdir()) == [out]
    out.rename(tmp_path / "first.h5")
    with cell.connected():
        cell.arm.state()
    assert [event.call for event in read_recording(out).events] == ["state"]


def test_a_recording_is_not_overwritten(recording: Path):
    with pytest.raises(UsageError, match="exists already"):
        recorded_cell(toy_cell(), recording)
