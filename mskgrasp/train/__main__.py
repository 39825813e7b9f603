"""Program ``python -m mskgrasp.train``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Trains the grasp quality and displacement networks on a dataset.

Writes the model, its metrics on held-out parts, its card and figures. A run that was stopped resumes when it
is started again in the same way.

python -m mskgrasp.train --data data/demo --out models/demo

A first look within minutes: python -m mskgrasp.train --data data/demo --out models/quick --epochs 2"""


def main() -> int:
    """Parse, train, report."""
    with ctrl_c_deferred():
        from mskgrasp.runtime.options import parse
        from mskgrasp.train.config import DEFAULT_CONFIG, TrainConfig
    config = parse(
        TrainConfig, prog="python -m mskgrasp.train", description=DESCRIPTION, default_config=DEFAULT_CONFIG
    )
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.train.run import run_training
    return run_training(config)


if __name__ == "__main__":
    run("mskgrasp.train", main)
