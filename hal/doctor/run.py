"""Run of the doctor: checks of a cell in order, and what they found."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.text import Text

from hal.camera import RgbdFrame
from hal.cell import Cell
from hal.doctor.camera_checks import check_sight, check_stream, check_table, check_view
from hal.doctor.checks import (
    Finding,
    attempt,
    check_arm,
    check_calibration,
    check_disk,
    check_drivers,
    check_motion,
    check_reach,
    check_renderer,
)
from hal.doctor.config import DoctorConfig
from hal.doctor.dry_run import PACE, check_dry_run
from hal.doctor.gripper import measure_gripper
from hal.doctor.hand_checks import check_grip, check_hand
from hal.errors import BadBackend
from hal.open_cell import cell_from_values
from hal.operator import Operator
from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.runtime.console_table import report_console
from mskgrasp.runtime.options import parse

DESCRIPTION = """Checks a cell and prints one line per check: ok, warn or fail, and the remedy.

Drivers, connection, camera stream, calibration, workspace, the hand that the robot is configured for, the
table's height in the depth image. Nothing moves without --move, --dry-run or --gripper, and with --move or
--dry-run only once all checks have passed; before a real arm moves, its operator is asked. The last line says
what to do next. The exit code is 0 if nothing failed, else 1.

--gripper, on a real cell, measures instead what the hand truly does, for simulation to use: the hand is homed
and closes three times on nothing, which gives its speed; then it closes three times on a spring scale or load
cell that you hold between the pads and read, after you have measured with a tape how far it opens. The arm
stands still. After a question workspace.measured_grip is written into the cell's file; its comments stay.

python -m hal.doctor --cell configs/cells/sapien.yaml"""

_COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


def examine(path: Path, *, move: bool, dry_run: bool = False) -> Iterator[Finding]:
    """Findings of all checks, as they are made, in the order of the first day (docs/real_cell.md).

    Args:
        path: The cell file.
        move: Also move the arm by small steps, unless a check failed.
        dry_run: Also go the whole way of a grasp of nothing, at a tenth of the speed, unless a check failed.

    Raises:
        BadConfig: The file cannot be read.
        StoppedByOperator: The operator ends the program.
    """
    found: list[Finding] = []
    for finding in _examine(path, found, move=move, dry_run=dry_run):
        found.append(finding)
        yield finding


def _examine(path: Path, found: Sequence[Finding], *, move: bool, dry_run: bool) -> Iterator[Finding]:
    """As `examine`, which keeps ``found``, the findings until then."""
    values = read_yaml(path)
    yield from check_drivers(values)
    yield check_disk(Path.cwd())
    try:
        cell = cell_from_values(values, path)
    except (BadConfig, BadBackend) as error:
        yield Finding(level="fail", subject="cell file", text=str(error))
        return
    if dry_run and not cell.arm.simulated:
        cell.arm.slow_down(PACE)
    if cell.camera.rendered:
        yield check_renderer()
    yield Finding(level="ok", subject="cell file", text=f"{path}, type {values['type']}")
    if cell.recorded:
        yield Finding(level="ok", subject="workspace", text="not checked: a recorded arm repeats its motions")
    else:
        yield check_reach(cell.arm, cell.workspace)
    with contextlib.ExitStack() as devices:
        devices.callback(cell.arm.close)
        begin = time.monotonic()
        failed = attempt("arm", cell.arm.connect)
        if failed is None:
            yield from check_arm(cell.arm, time.monotonic() - begin)
            yield from check_hand(cell.arm)
        else:
            yield failed
        grip = None if cell.recorded else check_grip(values, path, cell.workspace)
        for finding in (grip, check_calibration(values, path, cell.workspace)):
            if finding is not None:
                yield finding
        devices.callback(cell.camera.close)
        yield from _check_camera(cell)
        if not (move or dry_run):
            return
        subject = "motion" if move else "dry run"
        refusal = _failed(subject, found) or _unasked(subject, cell)
        if refusal is not None:
            yield refusal
            return
        if move:
            yield from check_motion(cell.arm)
        if dry_run:
            refusal = _failed("dry run", found)
            yield from check_dry_run(cell) if refusal is None else (refusal,)


def _failed(subject: str, found: Sequence[Finding]) -> Finding | None:
    """The finding that a check was left out because an earlier one failed; None if none did."""
    if all(finding.level != "fail" for finding in found):
        return None
    return Finding(level="fail", subject=subject, text="not checked: repair what failed first")


def _unasked(subject: str, cell: Cell) -> Finding | None:
    """Ask once before a real arm moves; the finding that no operator agreed, None if one did.

    Raises:
        StoppedByOperator: The operator ends the program.
    """
    try:
        operator = Operator(cell)
    except UsageError as error:
        return Finding(level="fail", subject=subject, text=f"not checked: {error}")
    if not operator.confirm(
        "The arm and its fingers move. Is the cell clear, and your hand on the emergency stop? May the arm "
        "move? y: yes, n: no: "
    ):
        return Finding(level="fail", subject=subject, text="not checked: the operator said no")
    return None


def _check_camera(cell: Cell) -> Iterator[Finding]:
    failed = attempt("camera", cell.camera.connect)
    frames: list[RgbdFrame] = []
    if failed is None:
        yield from check_stream(cell.camera, frames)
    else:
        yield failed
    if not frames:
        yield Finding(
            level="warn", subject="table", text="not checked, there is no image: repair the camera first"
        )
        return
    yield from check_view(frames[-1], cell.workspace)
    hidden = list(check_sight(frames[-1], cell.arm, cell.workspace))
    yield from hidden or check_table(frames[-1], cell.workspace)


def main() -> int:
    """Check the cell and print the findings."""
    config = parse(DoctorConfig, prog="python -m hal.doctor", description=DESCRIPTION)
    if config.gripper:
        if config.move or config.dry_run:
            raise UsageError(
                "--gripper measures the hand alone; omit --move and --dry-run, or run one after the other"
            )
        return measure_gripper(config.cell)
    found, console = [], report_console()
    for finding in examine(config.cell, move=config.move, dry_run=config.dry_run):
        found.append(finding)
        level = Text(f"{finding.level:5}", style=_COLOURS[finding.level])
        console.print(level.append(f" {finding.subject:15} {finding.text}", style="default"), soft_wrap=True)
    counts = Counter(finding.level for finding in found)
    print(f"{counts['ok']} ok, {counts['warn']} warn, {counts['fail']} fail")
    print(next_step(found, config))
    return 1 if counts["fail"] else 0


def next_step(found: Sequence[Finding], config: DoctorConfig) -> str:
    """The line that ends a diagnosis: what to do next, or that the cell is ready."""
    for finding in found:
        if finding.level == "fail":
            return f"next: repair what failed first: {finding.subject}"
    warned = [finding.subject for finding in found if finding.level == "warn"]
    see = f" (see the warnings: {', '.join(dict.fromkeys(warned))})" if warned else ""
    again = f"python -m hal.doctor --cell {config.cell}"
    if not (config.move or config.dry_run):
        return f"next: {again} --move: the joints and the fingers move a little{see}"
    if not config.dry_run:
        return f"next: {again} --dry-run: a grasp of nothing at a tenth of the speed{see}"
    return f"ready for the first grasp{see}"
