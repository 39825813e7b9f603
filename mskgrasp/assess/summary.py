"""Summary of a part's trials: shares placed within a distance, errors, and the verdict for a tolerance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mskgrasp.assess.config import Tolerance
from mskgrasp.assess.trials import PLANNERS, PlannerName
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.share import Share
from mskgrasp.trials.placed_trial import CORRECTIONS, Correction, PlacedTrial

DISTANCES = (1e-4, 2.5e-4, 5e-4, 1e-3, 2e-3, 5e-3)
"""Distances from the target whose shares are reported, metres."""
ENOUGH = 0.95
"""Least share of all attempts within the tolerance for which a way of placing is advised."""

ADVICE: dict[Correction, str] = {
    "none": "place directly",
    "predicted": "correct by the prediction",
    "seen": "look at the part in the hand",
}
OTHERWISE = "use a fixture or another pose"


@dataclass(frozen=True, kw_only=True)
class Row:
    """Trials of one condition by one planner.

    Attributes:
        condition: Name of the condition.
        planner: Name of what planned the grasps.
        certified: Share planned by a certified grasp.
        uncertified: Number planned by a simulated grasp that is not certified.
        networks: Number planned by the networks; of the others nothing was planned.
        lifted: Share lifted.
        within: By correction, the share of all attempts placed within the tolerance.
        within_distance: The same within each of `DISTANCES`, whatever the turn.
        translation_rmse: Of the predicted displacement, metres; None where none was lifted.
        rotation_rmse: The same of the turn, radians.
        tilted: Number lifted that tilt by more than 2 degrees.
        reasons: Numbers of parts that were not placed, by reason.
    """

    condition: str
    planner: PlannerName
    certified: Share
    uncertified: int
    networks: int
    lifted: Share
    within: dict[Correction, Share]
    within_distance: dict[Correction, tuple[Share, ...]]
    translation_rmse: float | None
    rotation_rmse: float | None
    tilted: int
    reasons: dict[str, int]

    @property
    def planned_by(self) -> str:
        """What planned the grasps, in words: where a part has no certified grasp others did."""
        n, of = self.certified.n, self.certified.of
        if self.planner == "networks":
            return "the networks"
        counts = {"certified grasps": n, "uncertified ones": self.uncertified}
        used = {name: count for name, count in counts.items() if count}
        if of in used.values():
            return next(iter(used)) + ("" if n else " (no certified grasp)")
        planned = " and ".join(f"{name} in {count}" for name, count in used.items())
        if not used and not self.networks:
            return "nothing: no grasp was planned"
        if not used:
            some = "" if self.networks == of else f" in {self.networks} of {of} attempts"
            return f"the networks{some} (no certified grasp)"
        return f"{planned} of {of} attempts" + (", else the networks" if self.networks else "")

    @property
    def advice(self) -> Correction | None:
        """The least effort by which enough attempts end within the tolerance; None where none does."""
        return next((one for one in CORRECTIONS if self.within[one].value >= ENOUGH), None)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return dict(
            condition=self.condition,
            planner=self.planner,
            certified=self.certified.to_json(),
            uncertified=self.uncertified,
            networks=self.networks,
            lifted=self.lifted.to_json(),
            within={name: share.to_json() for name, share in self.within.items()},
            within_distance={
                name: [share.to_json() for share in shares] for name, shares in self.within_distance.items()
            },
            translation_rmse=self.translation_rmse,
            rotation_rmse=self.rotation_rmse,
            tilted=self.tilted,
            reasons=self.reasons,
        )


def summarise(trials: Sequence[PlacedTrial], tolerance: Tolerance, tilt_limit: float) -> list[Row]:
    """Summarise trials by condition and planner, in the order in which they first occur."""
    groups: dict[tuple[str, PlannerName], list[PlacedTrial]] = {}
    for condition in dict.fromkeys(trial.condition for trial in trials):
        for planner in PLANNERS:
            found = [trial for trial in trials if (trial.condition, trial.planner) == (condition, planner)]
            if found:
                groups[condition, planner] = found
    return [_row(*key, found, tolerance, tilt_limit) for key, found in groups.items()]


def _row(
    condition: str,
    planner: PlannerName,
    trials: Sequence[PlacedTrial],
    tolerance: Tolerance,
    tilt_limit: float,
) -> Row:
    parts = [trial.part for trial in trials]
    errors = {one: [trial.error(one) for trial in trials] for one in CORRECTIONS}

    def within(correction: Correction, distance: float, angle: float) -> Share:
        hits = [
            error is not None and error[0] <= distance and error[1] <= angle for error in errors[correction]
        ]
        return Share.count(hits, parts)

    lifted = [trial for trial in trials if trial.lifted]
    off = np.array(
        [
            np.subtract(trial.predicted, trial.measured)
            for trial in lifted
            if trial.predicted is not None and trial.measured is not None
        ]
    ).reshape(-1, 4)
    return Row(
        condition=condition,
        planner=planner,
        certified=Share.count([trial.planned_by == "certified" for trial in trials], parts),
        uncertified=sum(trial.planned_by == "uncertified" for trial in trials),
        networks=sum(trial.planned_by == "networks" for trial in trials),
        lifted=Share.count([trial.lifted for trial in trials], parts),
        within={one: within(one, tolerance.distance, tolerance.angle) for one in CORRECTIONS},
        within_distance={
            one: tuple(within(one, distance, np.inf) for distance in DISTANCES) for one in CORRECTIONS
        },
        translation_rmse=float(np.sqrt((off[:, :3] ** 2).sum(axis=1).mean())) if len(off) else None,
        rotation_rmse=float(np.sqrt((wrap_angle(off[:, 3]) ** 2).mean())) if len(off) else None,
        tilted=sum((trial.tilt or 0.0) > tilt_limit for trial in lifted),
        reasons=dict(sorted(Counter(trial.reason for trial in trials if trial.reason).items())),
    )


def verdict(rows: Sequence[Row], condition: str, tolerance: Tolerance) -> str:
    """The verdict for a condition in one sentence, by the planner whose advice needs the least effort."""
    found = [row for row in rows if row.condition == condition]
    if not found:
        return "no trial was made"
    if not any(row.lifted.n for row in found):
        return "no grasp lifted the part"

    def effort(row: Row) -> tuple[int, float]:
        advice = row.advice
        number = len(CORRECTIONS) if advice is None else CORRECTIONS.index(advice)
        return number, -max(share.value for share in row.within.values())

    best = min(found, key=effort)
    advice = best.advice
    shown = advice or max(CORRECTIONS, key=lambda one: best.within[one].value)
    share = best.within[shown]
    text = ADVICE[advice] if advice is not None else OTHERWISE
    low, high = share.interval
    return (
        f"{text}: {share.n} of {share.of} attempts ({share.value:.0%}, 95 % interval {low:.0%} to "
        f"{high:.0%}) "
        f"within {tolerance} by {best.planned_by}" + ("" if advice is not None else f", {_HOW[shown]}")
    )


_HOW: dict[Correction, str] = {
    "none": "placed directly",
    "predicted": "corrected by the prediction",
    "seen": "with a look at the part in the hand",
}


def summary_json(
    rows: Sequence[Row], part: dict[str, Any], verdicts: dict[str, str], tolerance: Tolerance
) -> dict[str, Any]:
    """Contents of ``report.json``."""
    return dict(
        schema_version=1,
        part=part,
        tolerance=asdict(tolerance),
        verdicts=verdicts,
        distances=list(DISTANCES),
        rows=[row.to_json() for row in rows],
    )
