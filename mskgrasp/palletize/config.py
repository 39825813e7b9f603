"""Settings of palletizing."""

from __future__ import annotations

import math
from pathlib import Path

from pydantic import Field, field_validator, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.settings import Tape
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.palletize.placement_records import Correction
from mskgrasp.planning.config import PlannerConfig


class PalletizeConfig(Config):
    """Settings of a palletizing run."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    cell: Path = SIMULATED_CELL
    """YAML file of the cell; by default the simulated one."""
    out: Path = Path("out/palletize")
    """Folder for trials.jsonl, report.html and the pictures."""
    parts: tuple[str, ...] = ("test",)
    """Names or folders of parts, or sets: test and validation (held out), train, new_sizes, starter,
    catalogue; N parts of a set, as in test:20; a .txt file of names."""
    n_parts: int = Field(default=0, ge=0)
    """Greatest number of parts, evenly chosen; 0: all."""
    trials: int = Field(default=3, ge=1, le=100_000)
    """Trials per part; with --slots, number of pallets."""
    target: str = "0.5,0.06,90"
    """x and y of the centre, m (base), and the direction of the part's longer side from above, degrees."""
    slots: Path | None = None
    """YAML file of slots in place of --target, filled with the parts in turn: configs/palletize/grid.yaml."""
    corrections: tuple[Correction, ...] = ()
    """Corrections to compare: none, predicted, truth; by default all that the cell supports."""
    tape: tuple[float, float] | None = None
    """Sides of the two tape squares on every part, m, such as 0.012 0.008, which measure the placement; by
    default the cell's tracker measures, and without a tracker placements stay unmeasured."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the parts' placements and the candidates."""
    workers: int = Field(default=0, ge=0)
    """Simulated cells that run in parallel; 0: one per core. The results do not depend on their number."""
    yes: bool = False
    """Ask no operator: the arm moves as soon as a grasp is planned."""
    planner: PlannerConfig = PlannerConfig()
    """Settings of the choice of grasps."""

    @field_validator("target")
    @classmethod
    def _target(cls, text: str) -> str:
        parse_target(text)
        return text

    @field_validator("tape")
    @classmethod
    def _tape(cls, sides: tuple[float, float] | None) -> tuple[float, float] | None:
        if sides is not None:
            Tape(large=sides[0], small=sides[1])
        return sides

    @model_validator(mode="after")
    def _one_target(self) -> PalletizeConfig:
        if self.slots is not None and self.target != PalletizeConfig.model_fields["target"].default:
            raise ValueError("target and slots exclude each other: leave one out")
        return self

    def squares(self) -> Tape | None:
        """The tape that measures; None: the tracker."""
        return None if self.tape is None else Tape(large=self.tape[0], small=self.tape[1])


def parse_target(text: str) -> tuple[float, float, float]:
    """Parse ``x,y,theta`` in metres and degrees.

    Raises:
        ValueError: The text is not three finite numbers.
    """
    try:
        x, y, theta_deg = (float(word) for word in text.split(","))
    except ValueError:
        raise ValueError("target must be x,y,theta in metres and degrees") from None
    if not all(map(math.isfinite, (x, y, theta_deg))):
        raise ValueError("target must be finite")
    return x, y, theta_deg
