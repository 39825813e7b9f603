"""Measurement of a real hand: with both drivers over the wire, and its refusals."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import yaml

from hal import ArmState
from hal.config import MeasuredGrip
from hal.doctor import run as doctor
from hal.doctor.gripper import Grip, NotMeasured, closing_speed
from hal.replay import recorded_cell
from hal.sim.config import SapienCellConfig
from mskgrasp.core.geometry import Pose
from tests.hal.franka.robots import FakeRobot, robot_for, write_cell
from tests.hal.real_cell import REAL, REPLAYED
from tests.hal.replay.toy import toy_cell
from tests.programs import run_here


class Scale(io.StringIO):
    """A terminal whose operator puts a scale 20 mm wide between the pads when asked to."""

    def __init__(self, robot: FakeRobot, answers: list[str], scale_at: int) -> None:
        super().__init__()
        self.robot, self.answers, self.scale_at, self.asked = robot, answers, scale_at, 0

    def isatty(self) -> bool:
        return True

    def readline(self, *_: object) -> str:  # type: ignore[override]
        self.asked += 1
        if self.asked == self.scale_at:
            self.robot.order("part 0.02")
        return self.answers.pop(0) + "\n" if self.answers else ""


ANSWERS = ["y", "79.5", "y", "31", "y", "33,5", "y", "32", "y"]


@pytest.mark.parametrize("driver", ["franky", pytest.param("panda_py", marks=pytest.mark.slow)])
def test_speed_width_and_force_of_a_hand_are_written_into_its_cells_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, driver
):
    with robot_for(driver) as robot:
        path = write_cell(tmp_path, driver, robot.host, gripper_speed=0.05)
        path.write_text("# my cell\n" + path.read_text())
        monkeypatch.setattr("sys.stdin", Scale(robot, list(ANSWERS), 3))
        done = run_here(doctor.main, "--cell", str(path), "--gripper")
    assert done.returncode == 0, done.stderr
    text = path.read_text()
    assert text.startswith("# my cell\n") and "wrote workspace.measured_grip" in done.stdout
    found = MeasuredGrip(**yaml.safe_load(text)["workspace"]["measured_grip"])
    assert (found.grasp_force, found.finger_force) == (30.0, 32.0)
    # The pads of our own server move at the commanded 50 mm/s, or slower on a busy machine; franky-sim's are
    # pulled to their goal as fast as its dynamics let them.
    assert 0.005 < found.finger_speed < (0.03 if driver == "panda_py" else 0.2)
    assert found.max_width == pytest.approx(0.08, abs=2e-3)
    assert "readings 31, 33.5, 32 N" in done.stdout
    assert "grasp_force: 32.0\nphysics: {finger_speed: " in done.stdout


@pytest.mark.slow
def test_a_file_stays_as_it_is_where_nothing_is_held_or_the_operator_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with robot_for("franky") as robot:
        path = write_cell(tmp_path, "franky", robot.host)
        before = path.read_bytes()
        for answers, code, words in (
            (ANSWERS[:3], 1, "hold nothing; hold the scale between them"),
            (["n"], 130, "nothing moved"),
            ([], 130, "no answer"),
        ):
            monkeypatch.setattr("sys.stdin", Scale(robot, list(answers), 99))
            done = run_here(doctor.main, "--cell", str(path), "--gripper")
            assert done.returncode == code and words in done.stderr, done.stderr
        assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        (None, (), "No such file"),
        ("type: sapien\n", (), "a simulated hand applies what its settings say"),
        ("type: replay\nrecording: a.h5\n", (), "a recording has no hand to measure"),
        (REPLAYED, (), "a recording has no hand to measure"),
        ("type: sapien\n", ("--move",), "omit --move"),
        (REAL + "workspace: {table_z: 0.0}\n", (), "standard input is no terminal"),
        (REAL + "workspace: {table_z: null}\n", (), "run hal.touch"),
        (REAL + "workspace: {table_z: 0.0, measured_grip: {force: 3}}\n", (), "unknown key"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    text: str | None,
    arguments: tuple[str, ...],
    message: str,
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    if text is not None:
        Path("cell.yaml").write_text(text)
    if "a.h5" in (text or ""):
        with recorded_cell(toy_cell(), Path("a.h5")).connected() as cell:
            cell.arm.state()
    done = run_here(doctor.main, "--cell", "cell.yaml", "--gripper", *arguments)
    assert done.returncode == 2 and message in done.stderr
    assert done.stderr.startswith("program: ") and done.stderr.count("\n") == 1


def states(seconds: np.ndarray, widths: np.ndarray) -> list[ArmState]:
    return [
        ArmState(joints=np.zeros(7), T_base_tcp=Pose.identity(), gripper_width=width, timestamp_s=second)
        for second, width in zip(seconds, widths, strict=True)
    ]


def test_a_hand_that_measures_less_often_than_it_is_asked_is_timed_all_the_same():
    """Closing at 50 mm/s from 80 mm; new widths come every 30 ms, with half a second of rest at both ends."""
    seconds = np.arange(0.0, 2.6, 0.01)
    measured = np.floor(seconds / 0.03) * 0.03
    widths = np.clip(0.08 - 0.05 * (measured - 0.5), 0.0, 0.08)
    assert closing_speed(states(seconds, widths)) == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize("widths", [[], [0.08] * 50, [0.08, 0.04, 0.0], np.linspace(0.08, 0.075, 50)])
def test_fingers_that_did_not_close_or_were_not_seen_closing_are_not_timed(widths):
    with pytest.raises(NotMeasured, match="too few to time them") as caught:
        closing_speed(states(np.arange(len(widths)) * 0.01, np.array(widths)))
    assert "\n" not in str(caught.value)


def test_a_report_names_what_is_doubtful():
    grip = Grip(
        grasp_force=30.0, forces=np.array([20.0, 32.0, 31.0]), speeds=np.array([0.024, 0.026, 0.025]),
        max_width=0.08, tape_width=0.074,
    )  # fmt: skip
    width, speed, force, _, *simulated = grip.lines()
    cell = SapienCellConfig(type="sapien", **yaml.safe_load("\n".join(simulated)))
    assert (cell.grasp_force, cell.physics.finger_speed) == (31.0, 0.025)
    assert "-6.0 mm by tape: measure again" in width and "25.0 mm/s a finger, pads 50.0" in speed
    assert force.startswith("force  31.0 N a pad for 30 N") and "readings differ" in force
    assert yaml.safe_load(grip.to_yaml()) == {
        "grasp_force": 30.0, "finger_force": 31.0, "finger_speed": 0.025, "max_width": 0.08,
    }  # fmt: skip
