"""Settings of an assessment."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from pydantic import Field, field_validator

from mskgrasp.core.config import Config
from mskgrasp.core.grasp import TABLE_CLEARANCE
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.core.units import Unit
from mskgrasp.simulation.hull_count import hull_excess

_TOLERANCE = re.compile(r"\s*([0-9.]+)\s*(mm|m)\s*,\s*([0-9.]+)\s*(deg|rad)\s*")
SIMULATIONS, QUICK_SIMULATIONS = 1200, 400
"""Simulated grasps that certify a part's grasps."""
LEAST_SIMULATIONS = 24
"""Fewest of which any grasp comes, as in `mskgrasp.simulation.certify.CertifyConfig`."""
TRIALS, QUICK_TRIALS = 24, 8
"""Trials of each policy with an exact camera; half as many with noise, a quarter with each friction."""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Greatest distance of a placed part from its target, metres, and greatest error of its turn, radians."""

    distance: float
    angle: float

    def __str__(self) -> str:
        return f"{1e3 * self.distance:g} mm and {np.degrees(self.angle):g} degrees"


class AssessConfig(Config):
    """Settings of an assessment."""

    parts: tyro.conf.Positional[tuple[str, ...]] = ()
    """Names of parts, part folders, CAD files, or folders of CAD files."""
    tolerance: str = "1mm,2deg"
    """Greatest distance of a placed part from its target, mm or m, and greatest error of its turn about the
    vertical, deg or rad."""
    out: Path = Path("out/assess")
    """Folder for report.html, grasps.json, grasps.isaac.yaml and trials.jsonl; with several parts, of a
    folder for each, and index.html."""
    quick: bool = False
    """A third of the simulations and trials: two to three minutes on two cores. Of a part of more than 48
    convex pieces the rarest resting poses are left to the networks."""
    unit: Unit | None = None
    """Unit of a CAD file's coordinates, where the format states none; mm if not given."""
    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    simulations: int = Field(default=0, ge=0, le=1_000_000)
    """Approximate number of simulations that certify a part's grasps, at least 24 for each kind of resting
    pose; 0: 1200, or 400 with --quick, and fewer of a part of more than 48 convex pieces."""
    trials: int = Field(default=0, ge=0, le=100_000)
    """Trials of each policy with an exact camera; 0: 24, or 8 with --quick, and fewer of a part of more than
    48 convex pieces."""
    clearance: float = Field(default=TABLE_CLEARANCE, ge=TABLE_CLEARANCE, le=0.06)
    """Least distance of the pads from the table, m: `workspace.clearance` of your cell's file, which is 0.003
    if the file does not say, and on a sloping table 0.058 m times its slope more; 0.001 is that of the
    simulated cells."""
    workers: int = Field(default=0, ge=0)
    """Processes; 0: one per core. The results do not depend on their number."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines simulations and trials."""

    @field_validator("simulations")
    @classmethod
    def _enough(cls, simulations: int) -> int:
        if 0 < simulations < LEAST_SIMULATIONS:
            raise ValueError(f"at least {LEAST_SIMULATIONS}, or 0 for the default")
        return simulations

    @field_validator("tolerance")
    @classmethod
    def _tolerance(cls, text: str) -> str:
        parse_tolerance(text)
        return text

    def n_simulations(self, n_hulls: int) -> int:
        """Simulated grasps of a part of so many convex pieces."""
        usual = QUICK_SIMULATIONS if self.quick else SIMULATIONS
        return self.simulations or round(usual / hull_excess(n_hulls))

    def n_trials(self, n_hulls: int) -> int:
        """Trials of each policy with an exact camera, of a part of so many convex pieces."""
        usual = QUICK_TRIALS if self.quick else TRIALS
        return self.trials or round(usual / hull_excess(n_hulls))

    def least_probability_factor(self, n_hulls: int) -> float:
        """How many times as likely the rarest resting pose with certified grasps must be as by default.

        Each kind of resting pose takes the fewest simulations at least, which a quick run must not exceed.
        """
        return hull_excess(n_hulls) if self.quick else 1.0


def parse_tolerance(text: str) -> Tolerance:
    """The tolerance that a user writes as ``1mm,2deg``.

    Raises:
        ValueError: It is not a distance and an angle, or too large.
    """
    found = _TOLERANCE.fullmatch(text)
    try:
        if found is None:
            raise ValueError(text)
        distance = float(found[1]) * (1e-3 if found[2] == "mm" else 1.0)
        angle = float(found[3]) * (np.pi / 180 if found[4] == "deg" else 1.0)
    except ValueError:
        distance = angle = 0.0
    if not (0 < distance <= 0.1 and 0 < angle <= np.pi):
        raise ValueError(
            "a tolerance is a distance in mm or m and an angle in deg or rad, such as 1mm,2deg, each over 0 "
            "and at most 100 mm and 180 deg"
        )
    return Tolerance(distance=distance, angle=float(angle))
