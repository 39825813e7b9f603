"""Run of a measurement of the table: touches, plane, report."""

from __future__ import annotations

import datetime
import json
from typing import Any

import numpy as np

from hal.open_cell import cell_from_values
from hal.operator import Operator, StoppedByOperator
from hal.touch.cell_file import require_table_writable, write_table
from hal.touch.config import TouchConfig
from hal.touch.plane import fit_plane
from hal.touch.report import TableReport, draw_table
from hal.touch.touches import touch_table
from mskgrasp.core.config import read_yaml
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import write_whole
from mskgrasp.runtime.cli import check_folder, make_folder
from mskgrasp.runtime.options import parse

DESCRIPTION = """Measures height and tilt of a cell's table: the closed fingers touch it at five points.

What keeps the hand off the table follows from this measurement. Clear the region, keep a hand on the
emergency stop and start it: the arm moves home, closes its fingers, goes down slowly over a corner of the
region until it feels the table, touches it at the corners and in the middle, and moves home. A plane is
fitted to the points; one that is off it, because something lies there or the table is warped, is an error,
and nothing is written.

Before the first measurement the file says table_z: null, and the height by tape is given as --table-at Z,
good to 3 cm. Writes table.json and table.png into --out; a real cell's file is rewritten after a question
(--yes: without any): table_z, and table_slope where the tilt matters. The file of a simulated cell stays as
it is. See docs/touch.md.

python -m hal.touch --cell configs/cells/panda_kinect2.yaml --table-at 0.01"""


def measure(config: TouchConfig) -> tuple[TableReport, Operator | None]:
    """Touch the table of a cell and write the report; the cell's file stays as it is.

    Returns:
        The report, and the operator who was asked; None: the arm is simulated.

    Raises:
        UsageError: The cell is of another kind, or the height by tape is missing.
        NoPlane: The touches fit no plane.
        HalError: The table was not found, or the arm was stopped or lost.
        StoppedByOperator: The operator does not want the arm to move.
    """
    values = read_yaml(config.cell)
    stated = _stated_height(values, config)
    at = config.table_at
    if at is not None:
        values = {**values, "workspace": {**values["workspace"], "table_z": at}}
    cell = cell_from_values(values, config.cell)
    if cell.recorded:
        raise UsageError(
            f"{config.cell}: a recording has no table to touch; give the file of the cell itself"
        )
    operator = Operator(cell, yes=config.yes)
    check_folder(config.out)
    if not operator.confirm(
        f"The closed fingers touch the table at five points with {config.force:g} N. Is the region clear, "
        "and your hand on the emergency stop? May the arm move? y: yes, n: no: "
    ):
        raise StoppedByOperator("stopped by the operator; nothing moved")
    with cell.arm:
        points = touch_table(
            cell,
            search=config.search,
            force=config.force,
            speed=config.speed,
            touched=lambda number, point: print(
                f"touch {number + 1}: x {point[0]:.3f} m, y {point[1]:.3f} m, z {point[2]:.5f} m", flush=True
            ),
        )
    region = cell.workspace.region
    report = TableReport(
        cell=str(config.cell),
        made=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        region=region,
        stated_z=cell.workspace.table_z if cell.simulated else stated,
        points=points,
        plane=fit_plane(points, region, config.flatness),
        force=config.force,
        speed=config.speed,
    )
    make_folder(config.out)
    draw_table(report, config.out / "table.png")
    text = json.dumps(report.to_json(), indent=1, allow_nan=False)
    write_whole(config.out / "table.json", (text + "\n").encode())
    return report, None if cell.arm.simulated else operator


def _stated_height(values: dict[str, Any], config: TouchConfig) -> float | None:
    """Height that the file of a real cell states, metres; None for none."""
    path, workspace = config.cell, values.get("workspace")
    if not isinstance(workspace, dict):
        if config.table_at is not None:
            cell_from_values(values, path)  # faults of the file itself are reported first
            raise UsageError(f"--table-at is for a cell with arm and camera; {path} knows where its table is")
        return None
    require_table_writable(path)
    stated = workspace.get("table_z")
    if stated is None and config.table_at is None:
        raise UsageError(
            f"{path}: table_z is null; measure with a tape how high the table is over the robot's base and "
            "give it as --table-at Z (m, good to 3 cm)"
        )
    return float(stated) if isinstance(stated, int | float) else None


def main() -> int:
    """Touch the table, report, and write the cell's file."""
    config = parse(TouchConfig, prog="python -m hal.touch", description=DESCRIPTION)
    report, operator = measure(config)
    print("\n".join(report.lines()))
    print(f"wrote {config.out}/table.json and {config.out}/table.png")
    if operator is None or "workspace" not in read_yaml(config.cell):
        return 0
    slope = None if report.plane.level else report.plane.slope
    if not operator.confirm(f"Write this into {config.cell}? y: yes, n: no: "):
        print(f"{config.cell} is as before")
        return 0
    write_table(config.cell, report.plane.z, slope)
    print(f"wrote table_z {np.round(report.plane.z, 5)} into {config.cell}; next: python -m hal.doctor")
    return 0
