"""Record of one trial of the whole loop: a part looked at, grasped and placed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.json_text import Four, Three, checked
from mskgrasp.planning.grasp_plan import PlannedBy

Key = tuple[str, str, int, str]
"""Part, condition, number and planner of a trial."""
Correction = Literal["none", "predicted", "seen"]
CORRECTIONS: tuple[Correction, ...] = ("none", "predicted", "seen")
TOO_HEAVY = "too heavy for the arm"
"""Reason of a trial that was not made, followed by the mass."""


@dataclass(frozen=True, kw_only=True)
class PlacedTrial:
    """Outcome of a trial; metres and radians.

    Attributes:
        part: Name of the part.
        condition: Name of the cell's condition.
        number: Index of the trial; all planners share its scene.
        planner: Name of what planned the grasp, or was to plan it.
        planned_by: What the grasp comes from; None where none was found.
        lifted: The part was lifted and held.
        reason: Reason why it was not lifted or not placed; empty where it was placed.
        resting: Index of the resting pose that was found; None where the part was not recognised.
        wrong_pose: Another resting pose was found than the true one or its equals.
        quality: Expected share of successes, of the best grasp where all were refused; None: not predicted.
        grasp: (4,) the executed grasp.
        predicted: (4,) expected displacement of the part's origin from its true pose.
        measured: (4,) its true displacement; None where not lifted.
        held: (4,) displacement of the point that is to be placed: from the pose in which the part was found,
            its origin there; without such a pose, from its true pose, the seen centre.
        expected: (4,) its prediction, by which the placement is corrected.
        tilt: Of the part in the hand, radians.
        seeing: (3,) x, y and turn of the found pose less the true one, axes of the grasp frame; without such
            a pose, of the seen centre less that of the part's box, and no turn.
        carried: (3,) x, y and turn by which the point that is to be placed moved in the hand from the end of
            the lift to the moment before its release, axes of the grasp frame; None where not placed.
        placed: (3,) x, y and turn of the placed part less those of the target, axes of the hand's grasp frame
            at the target; None where not placed.
    """

    part: str
    condition: str
    number: int
    planner: str
    planned_by: PlannedBy | None = None
    lifted: bool = False
    reason: str = ""
    resting: int | None = None
    wrong_pose: bool = False
    quality: float | None = None
    grasp: Four | None = None
    predicted: Four | None = None
    measured: Four | None = None
    held: Four | None = None
    expected: Four | None = None
    tilt: float | None = None
    seeing: Three | None = None
    carried: Three | None = None
    placed: Three | None = None

    @property
    def key(self) -> Key:
        """Identifier of the trial in its run."""
        return self.part, self.condition, self.number, self.planner

    def off(self, correction: Correction) -> np.ndarray | None:
        """x, y and turn (3,) by which the part misses its target; None where it is unknown.

        That is where the part was not placed, or lay in another resting pose than was found.

        ``predicted`` is what was done and measured. Without a correction the part would have been off by its
        displacement as well, and with a look at the part in the hand by what follows the look alone.
        """
        if self.placed is None or self.held is None or self.expected is None or self.wrong_pose:
            return None
        off = np.array(self.placed)
        held, expected = (np.array(one)[[0, 1, 3]] for one in (self.held, self.expected))
        if correction == "none":
            return off + expected
        return off - (held - expected) if correction == "seen" else off

    def error(self, correction: Correction) -> tuple[float, float] | None:
        """Distance from the target, metres, and error of the turn, radians; None where `off` is."""
        off = self.off(correction)
        return None if off is None else (float(np.hypot(off[0], off[1])), float(abs(wrap_angle(off[2]))))

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> PlacedTrial:
        """The trial that `to_json` converted.

        Raises:
            TypeError, ValueError: The values are not a trial.
        """
        return checked(cls(**values))
