"""Program ``python -m mskgrasp.assess``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Says how precisely a part can be grasped and placed, from its CAD file, without a robot.

Finds the part's resting poses and its certified grasps, those whose outcome hardly spreads when they are
simulated again and again under the errors of a real cell. Then runs trials of the whole loop (look, plan,
grasp, place) by the networks and by certified grasps: with an exact camera, with the noise of a Kinect v2,
and with low and high friction. Writes report.html with a verdict for the tolerance, grasps.json and
grasps.isaac.yaml. Some minutes a part; a stopped run goes on where it was.

python -m mskgrasp.assess my_bracket.stl --tolerance 1mm,2deg

Several parts, or a folder of CAD files, also give an index page that ranks them."""


def main() -> int:
    """Parse, assess, report."""
    with ctrl_c_deferred():
        from mskgrasp.assess.config import AssessConfig
        from mskgrasp.runtime.options import parse
    config = parse(AssessConfig, prog="python -m mskgrasp.assess", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.assess.run import assess
    return assess(config)


if __name__ == "__main__":
    run("mskgrasp.assess", main)
