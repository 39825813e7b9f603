"""Program ``python -m mskgrasp.collect``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Simulates grasps of parts and records what happened.

For each part and attempt: the part lies in a resting pose at a random position and yaw, the overhead
camera takes a depth image, a grasp is drawn uniformly from the part's box in that image (with
--planned-by, a planner chooses it), the arm tries it, and one row is written: success, reason of failure,
how the part moved in the hand. A run that was stopped resumes when it is started again with the same
settings.

A few grasps of two parts: python -m mskgrasp.collect --parts hex_nut_m30 washer_m36 --attempts-per-part 20

Parts of your own, imported before: python -m mskgrasp.collect --parts my_bracket --out data/bracket

The demo dataset: python -m mskgrasp.collect --config configs/collect/demo.yaml"""


def main() -> int:
    """Parse, collect, report."""
    with ctrl_c_deferred():
        from mskgrasp.collect.config import CollectConfig
        from mskgrasp.core.shipped import config_file
        from mskgrasp.runtime.options import parse
    config = parse(
        CollectConfig,
        prog="python -m mskgrasp.collect",
        description=DESCRIPTION,
        default_config=config_file("collect/demo.yaml"),
    )
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.collect.run import collect
    collect(config)
    return 0


if __name__ == "__main__":
    run("mskgrasp.collect", main)
