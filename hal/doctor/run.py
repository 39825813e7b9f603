"""Program: what is wrong with a cell, and how to mend it. Run ``python -m hal.doctor --help``."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hal.camera import RgbdFrame
from hal.cell import Cell
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
    check_stream,
    check_table,
    check_view,
)
from hal.open_cell import cell_from_values
from mskgrasp.core.config import Config, read_yaml
from mskgrasp.core.errors import BadConfig
from mskgrasp.runtime.options import parse

DESCRIPTION = """Looks a cell over and prints one line for each thing: ok, warn or fail, and how to mend it.

Drivers, connection, camera stream, calibration, workspace, the table's height in the depth image. Nothing
moves without --move. Ends with 0 where nothing failed, with 1 otherwise."""


class DoctorConfig(Config):
    """Settings of one examination."""

    cell: Path
    """YAML file of the cell, for example configs/cells/panda_kinect2.yaml."""
    move: bool = False
    """Also move every joint by 0.03 rad and back, and the fingers (they drop what they hold)."""


def examine(path: Path, *, move: bool) -> Iterator[Finding]:
    """Everything that is found, as it is found.

    Args:
        path: The cell file.
        move: Also move the arm a little.

    Raises:
        BadConfig: The file cannot be read at all.
    """
    values = read_yaml(path)
    yield from check_drivers(values)
    if values.get("type") == "sapien" or _driver(values, "camera") == "sapien":
        yield check_renderer()
    yield check_disk(Path.cwd())
    try:
        cell = cell_from_values(values, path)
    except BadConfig as error:
        yield Finding(level="fail", subject="cell file", text=str(error))
        return
    yield Finding(level="ok", subject="cell file", text=f"{path}, type {values['type']}")
    calibration = check_calibration(values, path, cell.workspace)
    if calibration is not None:
        yield calibration
    if _driver(values, "arm") == "replay":
        yield Finding(level="ok", subject="workspace", text="not checked: a recorded arm goes where it went")
    else:
        yield check_reach(cell.arm, cell.workspace)
    with contextlib.ExitStack() as opened:
        opened.callback(cell.camera.close)
        yield from _look(cell)
        opened.callback(cell.arm.close)
        begin = time.monotonic()
        failed = attempt("arm", cell.arm.connect)
        if failed is not None:
            yield failed
            if move:
                yield Finding(level="fail", subject="motion", text="not tried: there is no arm")
            return
        yield from check_arm(cell.arm, time.monotonic() - begin)
        if move:
            yield from check_motion(cell.arm)


def _look(cell: Cell) -> Iterator[Finding]:
    failed = attempt("camera", cell.camera.connect)
    frames: list[RgbdFrame] = []
    if failed is None:
        yield from check_stream(cell.camera, frames)
    else:
        yield failed
    if not frames:
        yield Finding(
            level="warn", subject="table", text="not looked at, there is no picture: mend the camera first"
        )
        return
    yield from check_view(frames[-1], cell.workspace)
    yield from check_table(frames[-1], cell.workspace)


def _driver(values: dict[str, Any], section: str) -> Any:
    part = values.get(section)
    return part.get("driver") if isinstance(part, dict) else None


def main() -> int:
    """Examines and prints."""
    config = parse(DoctorConfig, prog="python -m hal.doctor", description=DESCRIPTION)
    counts = dict.fromkeys(("ok", "warn", "fail"), 0)
    for finding in examine(config.cell, move=config.move):
        counts[finding.level] += 1
        print(f"{finding.level:5} {finding.subject:15} {finding.text}", flush=True)
    print(f"{counts['ok']} ok, {counts['warn']} warn, {counts['fail']} fail")
    return 1 if counts["fail"] else 0
