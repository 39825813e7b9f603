"""Homing of a cell's hand."""

from __future__ import annotations

from hal.arm_state import ArmState
from hal.errors import NeedsRecovery
from hal.home.config import HomeConfig
from hal.open_cell import cell_from_yaml
from hal.operator import Operator, StoppedByOperator
from mskgrasp.runtime.options import parse

DESCRIPTION = """Homes the hand of a cell: its fingers close and open, so that it knows how far they open.

Run it whenever the fingers were changed: until then the hand believes in the width of those before, opens to
the wrong distance and reports wrong widths. The arm stands still; what is between the fingers falls. Asks
before the fingers of a real cell move (--yes: does not ask), and prints the width that was found. A robot
that an earlier program left in its reflex is recovered first, after a question of its own.

python -m hal.home --cell configs/cells/panda_kinect2.yaml"""


def home(config: HomeConfig) -> tuple[ArmState, ArmState]:
    """Home the hand and open it.

    Returns:
        The arm's states before and after.

    Raises:
        BadConfig: The cell's file is missing or not valid.
        UsageError: An operator must be asked, and standard input is no terminal.
        HalError: The hand could not be homed, or the arm is not there.
        StoppedByOperator: The operator does not want the fingers to move, or the arm to recover.
    """
    cell = cell_from_yaml(config.cell)
    operator = Operator(cell, yes=config.yes)
    if not operator.confirm(
        "The fingers close and open; the arm stands still. Is nothing between them, and are your hands away? "
        "y: yes, n: no: "
    ):
        raise StoppedByOperator("stopped by the operator; nothing moved")
    with cell.arm as arm:
        before = arm.state()
        try:
            arm.home()
        except NeedsRecovery as error:  # an earlier program left the robot in a reflex
            operator.recover(cell, str(error), then="the fingers close and open")
            arm.home()
        arm.open_gripper()
        return before, arm.state()


def main() -> int:
    """Home the hand and report its width."""
    config = parse(HomeConfig, prog="python -m hal.home", description=DESCRIPTION)
    before, after = home(config)
    print(
        f"homed: the fingers open to {1e3 * after.max_width:.1f} mm, {1e3 * before.max_width:.1f} mm before; "
        f"they stand at {1e3 * after.gripper_width:.1f} mm"
    )
    return 0
