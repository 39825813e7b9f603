"""Settings of a benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator, model_validator

from hal.sensor_noise import NoiseModel
from mskgrasp.core.config import Config
from mskgrasp.core.shipped import PRETRAINED, config_file

TRIALS, QUICK_TRIALS = 7, 2
"""Trials of each part by each planner."""
QUICK_PARTS = 12
"""Parts with --quick."""

BUILT_IN: tuple[str, ...] = ("centroid", "antipodal", "paper", "ours", "ours-min-quality", "certified")
"""Names of the planners of this program."""
PROGRAM = "program"
"""Name of the planner that --program starts."""


class BenchmarkConfig(Config):
    """Settings of a benchmark."""

    cell: str = "sapien"
    """Simulated cell: sapien, mujoco, or its YAML file."""
    planners: tuple[str, ...] = ()
    """Names of planners: centroid, antipodal, paper, ours, ours-min-quality, certified, and those of
    installed packages. Empty: all of this program that can run (paper needs --paper-models; --quick leaves
    out certified, which takes minutes a part), and the program of --program."""
    program: str = ""
    """Command of a program that plans, the row `program`; docs/benchmark.md describes what it reads and
    writes."""
    parts: tuple[str, ...] = ()
    """Parts in place of the benchmark's list: names, folders and sets, such as validation."""
    n_parts: int = Field(default=0, ge=0)
    """Greatest number of parts, evenly chosen; 0: all, or 12 of the list with --quick."""
    trials: int = Field(default=0, ge=0, le=100_000)
    """Trials of each part by each planner; 0: 7, or 2 with --quick."""
    quick: bool = False
    """12 parts, 2 trials, no certified grasps: under 15 minutes on two cores."""
    noise: NoiseModel | None = None
    """Noise of the camera over the table; by default that of the cell's file: none."""
    models: Path = PRETRAINED
    """Folder of the networks of ours, ours-min-quality and certified; by default the shipped ones."""
    paper_models: Path | None = None
    """Folder of the paper's networks, trained with configs/train/paper.yaml."""
    out: Path | None = None
    """Folder for report.html, report.json and trials.jsonl, or with --grasps for the scores. By default
    out/benchmark, or with --grasps the folder of the file."""
    grasps: Path | None = None
    """Score the top-down grasps of a file in the isaac_grasp format instead, for --part."""
    part: str = ""
    """Part of the grasps of --grasps: a name, a folder or a CAD file."""
    grasps_origin: Literal["mesh", "centroid"] = "mesh"
    """Origin of the poses in that file: that of the part's CAD file, or the part's centroid, as in the files
    that assess writes."""
    workers: int = Field(default=0, ge=0)
    """Processes; 0: one per core. The results do not depend on their number."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines scenes, targets and the errors of the camera that looks at the hand."""

    @field_validator("planners")
    @classmethod
    def _distinct(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(names)) < len(names):
            raise ValueError(f"a planner is named twice: {' '.join(names)}")
        return names

    @model_validator(mode="after")
    def _grasps_of_a_part(self) -> BenchmarkConfig:
        if self.part and self.grasps is None:
            raise ValueError("part is that of --grasps; parts to be grasped are named by --parts")
        return self

    @property
    def folder(self) -> Path:
        """Folder of the output."""
        return self.out or (Path("out/benchmark") if self.grasps is None else self.grasps.parent)

    @property
    def n_trials(self) -> int:
        """Trials of each part by each planner."""
        return self.trials or (QUICK_TRIALS if self.quick else TRIALS)

    @property
    def cell_file(self) -> Path:
        """YAML file of the cell."""
        return (
            config_file(f"cells/{self.cell}.yaml") if self.cell in ("sapien", "mujoco") else Path(self.cell)
        )

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the planners."""
        if self.planners:
            return self.planners
        left_out = {"paper"} if self.paper_models is None else set()
        if self.quick:
            left_out.add("certified")
        own = tuple(name for name in BUILT_IN if name not in left_out)
        return (*own, PROGRAM) if self.program else own
