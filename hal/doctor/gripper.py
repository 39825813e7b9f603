"""Measurement of what a real hand does: its speed, its greatest width and, by a scale, its force."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hal.arm import Arm
from hal.arm_state import ArmState
from hal.cell import Cell
from hal.cell_file import number, require_writable, write_values
from hal.errors import HalError
from hal.open_cell import cell_from_values
from hal.operator import Operator, StoppedByOperator
from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import UsageError

SECTION, KEY, ANCHOR = "workspace", "measured_grip", "table_z"
_TIMES = 3
"""Number of closings, and of readings of the scale; their median counts."""
_SAMPLE_S = 0.01
_MIDDLE = (0.2, 0.8)
"""Part of the closing motion over which the fingers no longer accelerate."""
_LEAST_SAMPLES = 5
_SAME_WIDTH = 1e-3
"""A width by tape that is off by less agrees with the hand's own, metres."""
_SAME_FORCE = 0.2
"""Readings of the scale may differ by this share of their median."""


class NotMeasured(HalError):
    """The hand's speed or force could not be measured; nothing was written."""


@dataclass(frozen=True, kw_only=True)
class Grip:
    """What a hand was measured to do.

    Attributes:
        grasp_force: Commanded gripper force, N.
        forces: (n,) readings of the scale between the pads, N.
        speeds: (n,) speeds of each finger as the hand closed, m/s.
        max_width: Greatest distance of the pads by the hand's own measurement, metres.
        tape_width: The same by tape or caliper, metres.
    """

    grasp_force: float
    forces: np.ndarray
    speeds: np.ndarray
    max_width: float
    tape_width: float

    @property
    def finger_force(self) -> float:
        """Median force of each pad, N."""
        return float(np.median(self.forces))

    @property
    def finger_speed(self) -> float:
        """Median speed of each finger, m/s."""
        return float(np.median(self.speeds))

    def lines(self) -> list[str]:
        """The result as lines of text."""
        off = self.tape_width - self.max_width
        width = f"width  {1e3 * self.max_width:.1f} mm by the hand, {off * 1e3:+z.1f} mm by tape"
        if abs(off) > _SAME_WIDTH:
            width += ": measure again, and see that the closed pads meet"
        spread = float(np.ptp(self.forces)) / self.finger_force
        force = f"force  {self.finger_force:.1f} N a pad for {self.grasp_force:g} N commanded"
        readings = ", ".join(f"{value:g}" for value in self.forces)
        force += f" (readings {readings} N)"
        if spread > _SAME_FORCE:
            force += ": readings differ; hold the scale straight between the pads and measure again"
        speed = f"speed  {1e3 * self.finger_speed:.1f} mm/s a finger, pads {2e3 * self.finger_speed:.1f} mm/s"
        simulated = [
            f"grasp_force: {self.finger_force:.1f}",
            f"physics: {{finger_speed: {number(self.finger_speed, 4)}}}",
        ]
        return [width, speed, force, "in the file of a simulated cell (docs/real_cell.md):", *simulated]

    def to_yaml(self) -> str:
        """Value of the key in the cell's file."""
        values = {
            "grasp_force": number(self.grasp_force, 2),
            "finger_force": number(self.finger_force, 2),
            "finger_speed": number(self.finger_speed, 4),
            "max_width": number(self.max_width, 4),
        }
        return "{" + ", ".join(f"{key}: {value}" for key, value in values.items()) + "}"


def measure_gripper(path: Path) -> int:
    """Measure the hand of a real cell with its operator, print the result, and write it into the cell's file.

    Returns:
        The exit code: 0, also where the operator does not want the file written.

    Raises:
        UsageError: The cell is simulated or a recording, or there is no terminal to ask an operator in.
        NotMeasured: The fingers held nothing, or closed too fast to be watched.
        HalError: The arm was stopped or lost.
        StoppedByOperator: The operator ended it; nothing was written.
    """
    values = read_yaml(path)
    cell = cell_from_values(values, path)
    _check_kind(cell, path)
    require_writable(path, "the measurement", SECTION, {KEY: "null"}, after=ANCHOR)
    operator = Operator(cell)
    with cell.arm:
        grip = measure(cell, operator)
    print("\n".join(grip.lines()), flush=True)
    if not operator.confirm(f"Write this into {path}? y: yes, n: no: "):
        print(f"{path} is as before")
        return 0
    write_values(path, SECTION, {KEY: grip.to_yaml()}, after=ANCHOR)
    print(f"wrote {SECTION}.{KEY} into {path}")
    return 0


def measure(cell: Cell, operator: Operator) -> Grip:
    """Home the hand, time its closing, and have the operator read tape and scale.

    Raises:
        NotMeasured: The fingers held nothing, or closed too fast to be watched.
        HalError: The arm was stopped or lost.
        StoppedByOperator: The operator ended it.
    """
    arm, force = cell.arm, cell.workspace.grasp_force
    if not operator.confirm(
        "The fingers are homed and close three times; the arm stands still. Is nothing between them, and are "
        "your hands away? y: yes, n: no: "
    ):
        raise StoppedByOperator("stopped by the operator; nothing moved")
    arm.home()
    speeds = []
    for _ in range(_TIMES):
        arm.open_gripper()
        speeds.append(closing_speed(watched(arm, lambda: arm.grasp(force))) / 2)
    arm.open_gripper()
    widest = arm.state().max_width
    tape = operator.number("Distance between the pads of the open hand, by tape or caliper, mm: ", 5, 150)
    forces = []
    while len(forces) < _TIMES:
        _ask_for_scale(operator, len(forces) + 1, force)
        outcome = arm.grasp(force)
        if not outcome.holding:
            arm.open_gripper()
            raise NotMeasured(
                f"the pads closed to {1e3 * outcome.width:.1f} mm and hold nothing; hold the scale between "
                "them and start again"
            )
        forces.append(operator.number("Reading of the scale, N (kg times 9.81): ", 1, 200))
        arm.open_gripper()
    return Grip(
        grasp_force=force,
        forces=np.array(forces),
        speeds=np.array(speeds),
        max_width=widest,
        tape_width=1e-3 * tape,
    )


def _ask_for_scale(operator: Operator, reading: int, force: float) -> None:
    if not operator.confirm(
        f"Reading {reading} of {_TIMES}: hold a spring scale or load cell that is pressed together between "
        f"the pads, fingers of yours away from them: the hand closes with {force:g} N. Ready? y: yes, n: no: "
    ):
        raise StoppedByOperator("stopped by the operator; nothing was written")


def watched(arm: Arm, command: Callable[[], object]) -> list[ArmState]:
    """States of an arm while it performs a command."""
    states: list[ArmState] = []
    done = threading.Event()

    def watch() -> None:
        with contextlib.suppress(HalError):  # the command reports what happened
            while not done.wait(_SAMPLE_S):
                states.append(arm.state())

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        command()
    finally:
        done.set()
        watcher.join()
    return states


def closing_speed(states: list[ArmState]) -> float:
    """Speed at which the pads' distance shrank in the middle of a closing motion, m/s.

    Raises:
        NotMeasured: There are too few states on the way.
    """
    seconds = np.array([state.timestamp_s for state in states])
    widths = np.array([state.gripper_width for state in states])
    if len(widths):
        share = (widths.max() - widths) / max(float(np.ptp(widths)), 1e-9)
        # A repeated width is an old sample: the hand measures less often than it is asked.
        new = np.append(True, np.diff(widths) != 0)
        middle = (share > _MIDDLE[0]) & (share < _MIDDLE[1]) & new
        if middle.sum() >= _LEAST_SAMPLES and np.ptp(widths) > 0.01:
            return float(-np.polyfit(seconds[middle] - seconds[middle][0], widths[middle], 1)[0])
    raise NotMeasured(
        f"{len(states)} states while the fingers closed are too few to time them; check the link to the "
        "robot (python -m hal.doctor), then measure again"
    )


def _check_kind(cell: Cell, path: Path) -> None:
    if cell.simulated:
        raise UsageError(
            f"{path}: a simulated hand applies what its settings say (grasp_force, physics.finger_speed); "
            "--gripper is for a real one"
        )
    if cell.recorded:
        raise UsageError(f"{path}: a recording has no hand to measure; give the file of the cell itself")
