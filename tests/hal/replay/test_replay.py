"""A recorded run plays back as it was, and nothing but it."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from hal import Cell, cell_from_yaml, execute_grasp
from hal.errors import (
    BadRecording,
    CaptureFailed,
    MotionAborted,
    NeedsRecovery,
    NotConnected,
    NotRecorded,
    Stopped,
)
from hal.replay import (
    ReplayArm,
    ReplayArmConfig,
    ReplayCamera,
    ReplayCameraConfig,
    ReplayCellConfig,
    read_recording,
    recorded_cell,
    replay_cell,
)
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import Grasp
from tests.hal.replay.toy import DOWN, ToyArm, ToyCamera, toy_cell

GRASP = np.array([0.45, 0.05, 0.06, 0.2])


def at(z: float, x: float = 0.4) -> Pose:
    return Pose(position=np.array([x, 0.0, z]), quat_wxyz=DOWN)


def run_on(cell: Cell, log: list[object]) -> None:
    """A program: every verb, every kind of answer, refusals and faults."""
    assert cell.feeder is not None and cell.tracker is not None
    cell.feeder.present("nut", 3)
    log.append(cell.camera.capture().depth.tolist())
    log.append(cell.tracker.part_pose().position.tolist())
    result = execute_grasp(cell, Grasp.from_vector(GRASP))
    log += [result.width, result.holding, result.T_base_tcp.position.tolist()]
    with pytest.raises(MotionAborted, match="contact force"):
        cell.arm.move_to_pose(at(0.03))
    with pytest.raises(NeedsRecovery, match="check the arm"):
        cell.arm.move_gripper(0.05)
    cell.arm.recover()
    cell.arm.move_to_joints(cell.workspace.home, speed=0.2)
    log.append(cell.arm.state().joints.tolist())
    for _ in range(2):
        log.append(cell.camera.capture().colour.tolist())
    with pytest.raises(CaptureFailed, match="no frame within 5 s"):
        cell.camera.capture()
    cell.arm.wait(0.5)
    log.append(cell.camera.capture().depth.tolist())


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "run.h5"
    with recorded_cell(toy_cell(), path).connected() as cell:
        run_on(cell, [])
    return path


def replayed(path: Path) -> Cell:
    return replay_cell(ReplayCellConfig(type="replay", recording=path))


def test_the_same_program_gets_the_same_answers(recording: Path, tmp_path: Path):
    live: list[object] = []
    with recorded_cell(toy_cell(), tmp_path / "again.h5").connected() as cell:
        run_on(cell, live)
    cell = replayed(recording)
    for _ in range(2):  # it can be opened again and begins anew
        played: list[object] = []
        with cell.connected():
            run_on(cell, played)
        assert json.dumps(played) == json.dumps(live)  # NaN compares as text
    assert cell.workspace.region == (0.3, 0.6, -0.1, 0.1)
    assert cell.arm.limits.max_force == 70.0


def test_a_recorded_cell_does_what_the_cell_does(tmp_path: Path):
    bare, kept = toy_cell(), toy_cell()
    logs: list[list[object]] = [[], []]
    with bare.connected():
        run_on(bare, logs[0])
    with recorded_cell(kept, tmp_path / "run.h5").connected() as cell:
        run_on(cell, logs[1])
    assert json.dumps(logs[0]) == json.dumps(logs[1])
    assert isinstance(bare.arm, ToyArm) and isinstance(kept.arm, ToyArm)
    assert bare.arm.moves == kept.arm.moves


def test_another_command_is_refused_names_both_and_nothing_follows_before_recover(recording: Path):
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        with pytest.raises(
            NotRecorded, match=r"was present\(part nut, seed 3\).*present\(part nut, seed 4\)"
        ):
            cell.feeder.present("nut", 4)
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        with pytest.raises(NotRecorded, match=r"was move_gripper\(width 0.08\).*grasp\(force 20.0\)"):
            cell.arm.grasp(20.0)
        with pytest.raises(NeedsRecovery, match=r"recover\(\)"):
            cell.arm.move_gripper(0.08)
        cell.arm.recover()
        cell.arm.move_gripper(0.08)


def test_commands_may_differ_by_the_tolerances_and_no_more(recording: Path):
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        execute_grasp(cell, Grasp.from_vector(GRASP + np.array([5e-4, 0, 0, 5e-3])))
    with replayed(recording).connected() as cell:
        assert cell.feeder is not None
        cell.feeder.present("nut", 3)
        cell.camera.capture()
        with pytest.raises(NotRecorded):
            execute_grasp(cell, Grasp.from_vector(GRASP + np.array([2e-3, 0, 0, 0])))


def test_a_frame_comes_where_it_was_taken(recording: Path):
    with replayed(recording).connected() as cell, pytest.raises(NotRecorded, match="asks for capture"):
        cell.camera.capture()


def test_stop_from_the_program_ends_what_follows(recording: Path):
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.stop()
        with pytest.raises(Stopped, match="stop"):
            arm.move_gripper(0.08)


def test_camera_and_arm_play_back_alone(recording: Path):
    camera = ReplayCamera(ReplayCameraConfig(driver="replay", recording=recording))
    with camera:
        assert [camera.capture().depth[1, 1] for _ in range(3)] == [1, 2, 3]
        with pytest.raises(CaptureFailed, match="no frame within 5 s"):
            camera.capture()
        assert camera.capture().depth[1, 1] == 5
        with pytest.raises(CaptureFailed, match="all 5 frames.*camera.loop"):
            camera.capture()
    arm = ReplayArm(ReplayArmConfig(driver="replay", recording=recording))
    with arm:
        arm.move_gripper(0.08)
        assert arm.state().gripper_width == 0.08
    with pytest.raises(NotConnected):
        arm.state()


def test_a_camera_may_begin_again(recording: Path):
    with ReplayCamera(ReplayCameraConfig(driver="replay", recording=recording, loop=True)) as camera:
        seen = []
        for _ in range(11):
            try:
                seen.append(int(camera.capture().depth[1, 1]))
            except CaptureFailed:
                seen.append(0)
    assert seen == [1, 2, 3, 0, 5, 1, 2, 3, 0, 5, 1]


def test_the_file_is_plain_hdf5_as_documented(recording: Path):
    with h5py.File(recording) as file:
        assert file.attrs["kind"] == "mskgrasp cell recording" and file.attrs["schema"] == 1
        assert file["frames/depth"].shape == (4, 4, 6) and file["frames/depth"].dtype == np.float32
        assert file["frames/colour"].dtype == np.uint8 and file["frames"].attrs["serial"] == "toy"
        events = [json.loads(text) for text in file["events"].asstr()[:]]
    assert events[0]["call"] == "present" and events[0]["arguments"] == {"part": "nut", "seed": 3}
    aborted = next(event for event in events if event["error"])
    assert aborted["error"][0] == "MotionAborted" and aborted["after"]["T_base_tcp"][2] > 0.1


def test_a_fine_colour_image_is_recorded_where_the_camera_has_one(recording: Path, tmp_path: Path):
    path = tmp_path / "fine.h5"
    fine_cell = dataclasses.replace(toy_cell(), camera=ToyCamera(fine=True))
    with recorded_cell(fine_cell, path).connected() as cell:
        for _ in range(2):
            cell.camera.capture()
    fine = read_recording(path).frame(1, 0.0).fine_colour
    assert fine is not None and fine.shape == (8, 12, 3) and (fine == 20).all()
    assert read_recording(recording).frame(1, 0.0).fine_colour is None


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


def test_a_cell_that_does_not_open_leaves_no_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(_: object) -> None:
        raise NotConnected("no robot there")

    monkeypatch.setattr(ToyArm, "connect", refuse)
    with pytest.raises(NotConnected), recorded_cell(toy_cell(), tmp_path / "run.h5").connected():
        pass
    assert not list(tmp_path.iterdir())


def test_a_recording_is_not_overwritten(recording: Path):
    with pytest.raises(UsageError, match="exists already"):
        recorded_cell(toy_cell(), recording)


def test_cell_files_of_recordings_are_checked(recording: Path, tmp_path: Path):
    def build(text: str) -> Cell:
        (tmp_path / "cell.yaml").write_text(text)
        return cell_from_yaml(tmp_path / "cell.yaml")

    assert build(f"type: replay\nrecording: {recording}").feeder is not None
    with pytest.raises(BadRecording, match="there is no recording"):
        build("type: replay\nrecording: none.h5")
    with pytest.raises(BadConfig, match="unknown key 'loop'"):
        build(f"type: replay\nrecording: {recording}\nloop: true")
    with pytest.raises(BadConfig, match="is recorded itself"):
        build(f"type: recorded\ncell: {tmp_path / 'cell.yaml'}\nout: {tmp_path / 'x.h5'}")
