"""The command ``mskgrasp``: every program as a subcommand."""

from __future__ import annotations

import importlib
import sys

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

PROGRAMS = {
    "parts": ("mskgrasp.parts", "build, import, list and show parts"),
    "collect": ("mskgrasp.collect", "simulate random grasps of parts and record a dataset"),
    "dataset": ("mskgrasp.dataset", "check, describe and export datasets"),
    "train": ("mskgrasp.train", "train the networks on a dataset"),
    "plan": ("mskgrasp.plan", "plan one grasp of the part in a cell"),
    "evaluate": ("mskgrasp.evaluate", "plan and execute grasps and report how well they go"),
    "palletize": (
        "mskgrasp.palletize",
        "grasp parts and place them, corrected by the predicted displacement",
    ),
    "serve": ("mskgrasp.serve", "answer requests for grasps over HTTP"),
    "assess": ("mskgrasp.assess", "say how precisely a part can be grasped, from its CAD file"),
    "benchmark": (
        "mskgrasp.benchmark",
        "compare planners by the share of attempts that place a part within a tolerance",
    ),
    "validate": (
        "mskgrasp.validate",
        "check the simulation's settings against closed forms and finer settings",
    ),
    "doctor": ("hal.doctor", "check a cell's camera and arm"),
    "home": ("hal.home", "home a cell's hand after its fingers were changed"),
    "touch": ("hal.touch", "measure the height and tilt of a cell's table by touching it"),
    "calibrate": ("hal.calibrate", "find the camera's pose relative to the robot"),
    "record": ("hal.record", "record a cell's frames, or a whole run, for replay"),
}
"""Module and purpose of each program by its name, in the order of work."""


def main() -> None:
    """Run the program named by the first argument with the other arguments, as ``python -m`` does."""
    name = sys.argv[1] if len(sys.argv) > 1 else "--help"
    if name in ("-h", "--help"):
        print("usage: mskgrasp PROGRAM [OPTIONS]\n")
        print("\n".join(f"  {known:10} {purpose}" for known, (_, purpose) in PROGRAMS.items()))
        print("\nmskgrasp PROGRAM --help explains the options of a program.")
        sys.exit(0)
    if name not in PROGRAMS:
        print(f"mskgrasp: no program is called {name!r}; legal: {', '.join(PROGRAMS)}", file=sys.stderr)
        sys.exit(2)
    del sys.argv[1]
    module, _ = PROGRAMS[name]
    run(module, lambda: _run_program(module))


def _run_program(module: str) -> int | None:
    with ctrl_c_deferred():
        program = importlib.import_module(f"{module}.__main__")
    return program.main()


if __name__ == "__main__":
    main()
