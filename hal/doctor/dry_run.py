"""A grasp of nothing at a tenth of the cell's speed: the whole way of a grasp, before the first part."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hal.cell import Cell
from hal.doctor.checks import Finding
from hal.errors import HalError
from hal.execute import execute_grasp, go_home
from mskgrasp.core.grasp import Grasp

PACE = 0.1
"""Share of its speeds at which a real arm moves in the dry run."""
IN_THE_AIR = 0.05
"""Height of the dry run over the lowest grasp, metres."""


def check_dry_run(cell: Cell) -> Iterator[Finding]:
    """Go home, grasp nothing over the middle of the region, and go home again.

    Args:
        cell: Its arm is connected.
    """
    x, y = cell.workspace.centre
    z = float(cell.workspace.lowest_grasp_z(cell.workspace.centre)) + IN_THE_AIR
    try:
        go_home(cell)
        result = execute_grasp(cell, Grasp(position=np.array([x, y, z]), theta=np.asarray(0.0)))
    except HalError as error:
        yield Finding(level="fail", subject="dry run", text=str(error))
        return
    if result.aborted:
        yield Finding(level="fail", subject="dry run", text=result.aborted)
        return
    if result.holding:
        yield Finding(
            level="fail", subject="dry run",
            text="the hand reports a part where there is none: raise closed_width in the cell's file, or run "
            "hal.home",
        )  # fmt: skip
    try:
        if result.holding:
            cell.arm.open_gripper()  # over the empty region; a real arm goes home with an empty hand only
        go_home(cell)
    except HalError as error:
        yield Finding(level="fail", subject="dry run", text=str(error))
        return
    if not result.holding:
        yield Finding(
            level="ok", subject="dry run",
            text=f"a grasp of nothing, {1e3 * IN_THE_AIR:.0f} mm over the lowest: nothing held, back home",
        )  # fmt: skip
