"""Program ``python -m mskgrasp.demo``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Plans a grasp of an example part, carries it out in the simulated cell and films it.

Writes plan.png, the candidates and the chosen grasp, and grasp.gif, which shows the part shift between the
fingers beside the shift that was expected. Takes less than a minute.

A part of your own: python -m mskgrasp.demo --part my_bracket.stl"""


def main() -> int:
    """Parse, grasp, report."""
    with ctrl_c_deferred():
        from mskgrasp.demo.config import DemoConfig
        from mskgrasp.runtime.options import parse
    config = parse(DemoConfig, prog="python -m mskgrasp.demo", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.demo.run import demo_text, demonstrate
    demo = demonstrate(config)
    print(demo_text(demo))
    print(f"wrote {config.out}/plan.png and {config.out}/grasp.gif: open them")
    return 1 if demo.failure else 0


if __name__ == "__main__":
    run("mskgrasp.demo", main)
