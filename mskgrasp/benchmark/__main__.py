"""Program ``python -m mskgrasp.benchmark``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Measures how many of all attempts of each planner place the part where it is meant to be.

60 parts, a frozen list that the shipped model was not trained on, lie in seeded scenes in a simulated cell.
Every planner looks at the same scenes, its grasps are carried out and the parts placed: without correction,
corrected by the planner's own prediction, by a camera that looks at the part in the hand, and by the truth.
Writes report.html and report.json: shares within 0.25 to 5 mm and 1 to 5 degrees, precision against the
share refused, and what the error is made of. Some hours on two cores; a stopped run goes on where it was.

python -m mskgrasp.benchmark --quick

python -m mskgrasp.benchmark --cell mujoco --planners ours centroid

Your own planner takes part as a Python package or as a program, and grasps in the isaac_grasp format are
scored (--grasps FILE.yaml --part NAME): docs/benchmark.md."""


def main() -> int:
    """Parse, run, report."""
    with ctrl_c_deferred():
        from mskgrasp.benchmark.config import BenchmarkConfig
        from mskgrasp.runtime.options import parse
    config = parse(BenchmarkConfig, prog="python -m mskgrasp.benchmark", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.benchmark.run import benchmark
        from mskgrasp.benchmark.score_grasps import score_file
    if config.grasps is not None:
        score_file(config, config.grasps)
    else:
        benchmark(config)
    return 0


if __name__ == "__main__":
    run("mskgrasp.benchmark", main)
