"""Settings of the evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator

from hal.sensor_noise import NoiseModel
from mskgrasp.core.config import Config
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.planning.config import PlannerConfig

Experiment = Literal["success", "displacement"]


class EvaluateConfig(Config):
    """Settings of an evaluation."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one. It predicts the qualities."""
    experiment: Experiment = "success"
    """success: the policy of --planner.policy. displacement: three policies, known and novel parts apart, and
    certified grasps where --planner.policy is certified."""
    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    noise: NoiseModel | None = None
    """Noise of a simulated camera (iid: 3 mm per pixel); overrides the cell's file."""
    measure: Literal["truth", "markers"] = "truth"
    """truth: the cell's tracker measures the displacement; markers: two squares of tape (docs/markers.md)."""
    tape: tuple[float, float] | None = None
    """Sides of both squares, m, the larger first; by default 0.012 0.008, or those of a simulated cell."""
    out: Path = Path("out/eval")
    """Folder for trials.jsonl, report.json and the pictures."""
    parts: tuple[str, ...] = ()
    """Names or folders of parts, or sets: train (the model's training parts), validation and test (held out),
    new_sizes, starter, catalogue; N parts of a set, as in train:50; a .txt file of names. By default
    validation, for displacement train and validation."""
    n_parts: int = Field(default=0, ge=0)
    """Greatest number of parts, evenly chosen, an equal share of every set; 0: all."""
    trials: int = Field(default=5, ge=1, le=100_000)
    """Trials per part."""
    compare: tuple[str, ...] = ()
    """Models of the displacement experiment, label=folder each; by default the one of --models."""
    chooses: tuple[str, ...] = ()
    """Trials per part in which a model of the displacement experiment chooses a grasp of its own by its
    variances, label=number each (lowess=7); a model that is not named does in all."""
    lowess_data: Path | None = None
    """A collected dataset: LOWESS predicts the parts of which it holds grasps."""
    workers: int = Field(default=0, ge=0)
    """Simulated cells that run in parallel; 0: one per core."""
    estimate: bool = False
    """Only state how long the missing trials take, measured with two parts of the starter set."""
    yes: bool = False
    """Ask no operator: the arm moves as soon as a grasp is planned, on a real cell, too."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the parts' placements and the candidates."""
    planner: PlannerConfig = PlannerConfig(policy="quality")
    """Settings of the choice of grasps."""
    replay: tuple[Path, str] | None = None
    """Only draw a stored trial again: the folder of a run, and the trial's name."""

    @field_validator("compare", "chooses", mode="before")
    @classmethod
    def _from_mapping(cls, value: Any) -> Any:
        return [f"{label}={one}" for label, one in value.items()] if isinstance(value, dict) else value
