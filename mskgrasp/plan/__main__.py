"""Program ``python -m mskgrasp.plan``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Takes a depth image of the cell and plans a precise grasp of the part in it.

Samples grasps over the part, keeps those of the best predicted quality, and chooses the one whose
displacement in the hand is best known. Nothing moves, except home with --go-home: an arm that may be in the
camera's view is an error. Writes plan.png and plan.json.

A part of your own: python -m mskgrasp.plan --part my_bracket.stl"""


def main() -> int:
    """Parse, plan, report."""
    with ctrl_c_deferred():
        from mskgrasp.plan.config import PlanConfig
        from mskgrasp.runtime.options import parse
    config = parse(PlanConfig, prog="python -m mskgrasp.plan", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.plan.run import plan_grasp
        from mskgrasp.planning.plan_text import plan_text
    print(plan_text(plan_grasp(config)))
    print(f"wrote {config.out / 'plan.json'} and {config.out / 'plan.png'}")
    return 0


if __name__ == "__main__":
    run("mskgrasp.plan", main)
