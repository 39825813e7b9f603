"""``python -m mskgrasp.validate``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Shows whether simulated labels are right: run it after changing a setting or a part.

Three kinds of evidence: experiments whose outcome follows from closed-form physics; parts as the engine
cooked them, against their meshes; and the same grasps under coarser and finer settings, against the finest,
beside the floor: the finest setting against itself with the starts moved by 10 um. Writes validate.json and
validate.png; ends with 1 if a check fails or the settings under test add something to the floor."""


def main() -> int:
    """Parses, checks, reports."""
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
    with ctrl_c_deferred():  # loads the simulator: not for a mistyped option
        from mskgrasp.validate.run import validate
    return validate(config)


if __name__ == "__main__":
    run("mskgrasp.validate", main)
