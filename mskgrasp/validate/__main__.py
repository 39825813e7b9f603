"""``python -m mskgrasp.validate``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Shows whether simulated labels are right: run it after changing a setting or a part.

Three kinds of evidence: experiments whose outcome follows from closed-form physics; parts as the engine
cooked them, against their meshes; and the same grasps under finer references, coarser settings and other
values of what is not known exactly. Production must be equivalent to the reference by two one-sided tests.
Writes validate.json and validate.png; ends with 1 if a check fails or the equivalence is not shown. Fewer
than ten parts cannot show it: a note says so, and only the checks count.

The checks alone: python -m mskgrasp.validate --no-convergence"""


def main() -> int:
    """Parse, check, report."""
    with ctrl_c_deferred():
        from mskgrasp.core.shipped import config_file
        from mskgrasp.runtime.options import parse
        from mskgrasp.validate.config import ValidateConfig
    config = parse(
        ValidateConfig,
        prog="python -m mskgrasp.validate",
        description=DESCRIPTION,
        default_config=config_file("validate/default.yaml"),
    )
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.validate.run import validate
    return validate(config)


if __name__ == "__main__":
    run("mskgrasp.validate", main)
