"""Program ``python -m mskgrasp.palletize``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Grasps parts, places each at its target, and measures its distance from the target.

Every trial is run once for each correction, with the same part in the same pose: none (as if the part did
not move in the hand), predicted (by the displacement network), truth (measured by the tracker: the best that
any prediction could achieve). Writes report.html, report.json and pictures. Every placement is stored at
once; the same command resumes a stopped run.

One target for all parts: --target 0.5,0.06,90

A pallet of several: --cell configs/palletize/cell.yaml --slots configs/palletize/grid.yaml

A real cell asks its operator to place every part, and before the arm moves (--yes: it asks nothing)."""


def main() -> int:
    """Parse, palletize, report."""
    with ctrl_c_deferred():
        from mskgrasp.palletize.config import PalletizeConfig
        from mskgrasp.runtime.options import parse
    config = parse(PalletizeConfig, prog="python -m mskgrasp.palletize", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.palletize.report import print_report
        from mskgrasp.palletize.run import palletize
    print_report(palletize(config))
    print(f"wrote {config.out}/report.html, report.json, trials.jsonl and a picture of every placement")
    return 0


if __name__ == "__main__":
    run("mskgrasp.palletize", main)
