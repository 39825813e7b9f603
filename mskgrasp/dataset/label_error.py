"""Error of a simulated label: difference of a grasp's outcome from that with another hand of the kind."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from mskgrasp.core.settings import Physics

STORED = Path(__file__).with_suffix(".json")
"""Written by ``make results ARGS="--record label_error"``, which runs `mskgrasp.validate`."""


@dataclass(frozen=True, kw_only=True)
class LabelError:
    """Differences of outcomes with hand and table drawn from their ranges, and of those in production.

    Attributes:
        simulation: Version of the simulation.
        n: Grasps.
        agreement: Share of grasps whose S is the same.
        shift_median: Median distance between the displacements' translations, m.
        shift_p90: Its 90th percentile, m.
        turn_median: Median difference of the displacements' turns, rad.
        turn_p90: Its 90th percentile, rad.
    """

    simulation: str
    n: int
    agreement: float
    shift_median: float
    shift_p90: float
    turn_median: float
    turn_p90: float

    def __str__(self) -> str:
        shift, tail = 1e3 * self.shift_median, 1e3 * self.shift_p90
        turn, turn_tail = math.degrees(self.turn_median), math.degrees(self.turn_p90)
        return (
            f"median {shift:.2f} mm, {turn:.2f} degrees; 90 % under {tail:.1f} mm, {turn_tail:.1f} degrees; "
            f"success agrees in {self.agreement:.1%} ({self.n} grasps; hand and table drawn)"
        )


def read_label_error(simulations: Collection[str], physics: Mapping[str, object], path: Path = STORED) -> str:
    """The error of labels of some versions of the simulation, in words.

    Args:
        simulations: Versions of the simulation.
        physics: Its settings; the error is known of production's, the defaults.
        path: The file with the error.
    """
    found = LabelError(**json.loads(path.read_text(encoding="utf-8")))
    if set(simulations) != {found.simulation}:
        made = ", ".join(sorted(simulations)) or "unknown"
        return f"not known: made by simulation version {made}, measured for {found.simulation}"
    production = Physics().model_dump()
    other = [name for name in production if physics.get(name, production[name]) != production[name]]
    if other:
        return f"not known: measured for production's settings, of which {', '.join(other)} differ"
    return str(found)
