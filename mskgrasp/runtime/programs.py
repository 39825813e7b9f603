"""Programs of the command ``mskgrasp``, in the order of work; importing this loads nothing else."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Program:
    """A program.

    Attributes:
        module: Module that ``python -m`` runs.
        purpose: What it does, in a line.
        page: Page of the documentation that explains it, in the repository.
        options: ``module:NAME`` of its configuration, or of its commands' dataclasses by name.
    """

    module: str
    purpose: str
    page: str
    options: str


GROUPS: dict[str, dict[str, Program]] = {
    "First: see a grasp": {
        "demo": Program(
            "mskgrasp.demo",
            "plan, carry out and film a grasp of an example part",
            "docs/index.md",
            "mskgrasp.demo.config:DemoConfig",
        ),
    },
    "Your part, from its CAD file": {
        "parts": Program(
            "mskgrasp.parts",
            "build, import, list and show parts",
            "docs/parts.md",
            "mskgrasp.parts.commands.command_line:COMMANDS",
        ),
        "plan": Program(
            "mskgrasp.plan",
            "plan one grasp of the part in a cell",
            "docs/learning.md",
            "mskgrasp.plan.config:PlanConfig",
        ),
        "assess": Program(
            "mskgrasp.assess",
            "say how precisely a part can be grasped, from its CAD file",
            "docs/assess.md",
            "mskgrasp.assess.config:AssessConfig",
        ),
    },
    "Data and networks of your own": {
        "collect": Program(
            "mskgrasp.collect",
            "simulate grasps of parts and record a dataset",
            "docs/collect.md",
            "mskgrasp.collect.config:CollectConfig",
        ),
        "dataset": Program(
            "mskgrasp.dataset",
            "check, describe and export datasets",
            "docs/dataset.md",
            "mskgrasp.dataset.commands.command_line:VERBS",
        ),
        "train": Program(
            "mskgrasp.train",
            "train the networks on a dataset",
            "docs/learning.md",
            "mskgrasp.train.config:TrainConfig",
        ),
    },
    "Grasping, placing and measuring": {
        "evaluate": Program(
            "mskgrasp.evaluate",
            "plan and execute grasps and report how well they go",
            "docs/evaluate.md",
            "mskgrasp.evaluate.config:EvaluateConfig",
        ),
        "palletize": Program(
            "mskgrasp.palletize",
            "grasp parts and place them, corrected by the predicted displacement",
            "docs/palletize.md",
            "mskgrasp.palletize.config:PalletizeConfig",
        ),
        "benchmark": Program(
            "mskgrasp.benchmark",
            "compare planners by the share of attempts that place a part within a tolerance",
            "docs/benchmark.md",
            "mskgrasp.benchmark.config:BenchmarkConfig",
        ),
        "validate": Program(
            "mskgrasp.validate",
            "check the simulation's settings against closed forms and finer settings",
            "docs/validation.md",
            "mskgrasp.validate.config:ValidateConfig",
        ),
        "view": Program(
            "mskgrasp.view",
            "show parts, datasets, plans and trials in 3-D in the browser",
            "docs/view.md",
            "mskgrasp.view.config:ViewConfig",
        ),
        "serve": Program(
            "mskgrasp.serve",
            "answer requests for grasps over HTTP",
            "docs/serve.md",
            "mskgrasp.serve.config:ServeConfig",
        ),
    },
    "A real cell": {
        "doctor": Program(
            "hal.doctor",
            "check a cell's camera and arm",
            "docs/real_cell.md",
            "hal.doctor.config:DoctorConfig",
        ),
        "home": Program(
            "hal.home",
            "home a cell's hand after its fingers were changed",
            "docs/real_cell.md",
            "hal.home.config:HomeConfig",
        ),
        "touch": Program(
            "hal.touch",
            "measure the height and tilt of a cell's table by touching it",
            "docs/touch.md",
            "hal.touch.config:TouchConfig",
        ),
        "calibrate": Program(
            "hal.calibrate",
            "find the camera's pose relative to the robot",
            "docs/calibration.md",
            "hal.calibrate.config:CalibrateConfig",
        ),
        "record": Program(
            "hal.record",
            "record a cell's frames, or a whole run, for replay",
            "docs/replay.md",
            "hal.record.config:RecordConfig",
        ),
    },
}
"""Programs by their names, in groups."""

PROGRAMS: dict[str, Program] = {name: program for group in GROUPS.values() for name, program in group.items()}
"""All programs by their names."""


def guide(prog: str) -> str:
    """The line of ``--help`` that names the page; empty for a program that is not one of `PROGRAMS`.

    Args:
        prog: The command that starts the program, such as ``python -m mskgrasp.plan``.
    """
    module = prog.removeprefix("python -m ").split()[0]
    pages = [program.page for program in PROGRAMS.values() if program.module == module]
    return f"Explained in {pages[0]}; make docs builds all pages into build/site." if pages else ""
