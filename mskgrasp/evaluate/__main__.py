"""Program ``python -m mskgrasp.evaluate``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Plans and executes grasps on a cell and reports the outcomes.

--experiment success: how often the grasp of the best predicted quality lifts the part.
--experiment displacement: how well models predict how the part moves in the hand, for grasps of the best
quality and for those of low predicted variance among the best; --compare names the models, --lowess-data a
dataset from whose grasps LOWESS predicts. All models predict the same grasp of the best quality.

Every trial is stored at once with its frame: the same command resumes a stopped run, with more parts, trials
or models if asked for, and --replay OUT TRIAL draws one again. Simulated cells run in parallel; their number
does not change the results. A real cell asks its operator to place every part, and before the arm moves
(--yes: it asks nothing).

Ten held-out parts: python -m mskgrasp.evaluate --parts test --n-parts 10 --trials 2

One part: python -m mskgrasp.evaluate --parts hex_nut_m30 --trials 5 --out out/nut"""


def main() -> int:
    """Parse, evaluate, report."""
    with ctrl_c_deferred():
        from mskgrasp.evaluate.config import EvaluateConfig
        from mskgrasp.runtime.options import parse
    config = parse(EvaluateConfig, prog="python -m mskgrasp.evaluate", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.evaluate.report import print_report
        from mskgrasp.evaluate.run import estimate, evaluate, replay
    if config.replay is not None:
        replay(*config.replay)
        return 0
    if config.estimate:
        estimate(config)
        return 0
    report = evaluate(config)
    print_report(report, config.out)
    pictures = "success.png, errors.png" if config.experiment == "success" else "displacement.png"
    print(f"wrote {config.out}/report.html, report.json, {pictures}; any trial: --replay {config.out} TRIAL")
    return 0


if __name__ == "__main__":
    run("mskgrasp.evaluate", main)
