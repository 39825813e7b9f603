"""Program ``python -m mskgrasp.view``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Shows parts, datasets, plans and trials in 3-D in the browser.

--part shows a part in its resting poses, and plans its grasp in the simulated cell; --cell FILE plans on
another cell; --data shows the attempts of a dataset, and simulates them again; --run shows the trials of
mskgrasp.evaluate or mskgrasp.palletize. Only this machine can open the page; from another one forward the
port: ssh -L 8080:localhost:8080 MACHINE. No arm moves unless --allow-motion is given and each motion is
confirmed on the page. Needs the extra [view]."""


def main() -> int:
    """Parse, start, serve the page until Ctrl-C."""
    with ctrl_c_deferred():
        from mskgrasp.runtime.options import parse
        from mskgrasp.view.config import ViewConfig
    config = parse(ViewConfig, prog="python -m mskgrasp.view", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.view.run import view
    view(config)
    return 0


if __name__ == "__main__":
    run("mskgrasp.view", main)
