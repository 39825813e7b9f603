"""Simulated attempts that are no labels, and the worst values of those that are."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mskgrasp.core.grasp import MAX_DISPLACEMENT
from mskgrasp.validate.outcomes import Outcomes
from tasks.attempt.outcome import MAX_PENETRATION, MAX_SPEED


@dataclass(frozen=True, kw_only=True)
class DiscardSummary:
    """Worst values among the labels of the setting under test, and how many attempts the collector drops.

    Attributes:
        attempts: Number of attempts.
        penetration: Deepest overlap of finger and part in the kept attempts, m.
        fastest: Greatest speed of a part in the kept attempts, m/s.
        displaced: Largest displacement of a kept success, m.
        dropped: Number of attempts by reason.
    """

    attempts: int
    penetration: float
    fastest: float
    displaced: float
    dropped: dict[str, int]

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self)


def summarise_discards(outcomes: Outcomes) -> DiscardSummary:
    """Count the physically impossible outcomes and the worst values of the others."""
    way = np.linalg.norm(outcomes.displacement[:, :3], axis=1)
    reasons = {
        "unsettled": ~outcomes.settled,
        "penetrated": outcomes.penetration > MAX_PENETRATION,
        "too_fast": outcomes.fastest > MAX_SPEED,
        "moved_too_far": outcomes.success & (way > MAX_DISPLACEMENT),
        "not_finite": outcomes.success & ~np.isfinite(outcomes.displacement).all(axis=1),
    }
    kept = ~np.any(list(reasons.values()), axis=0)
    return DiscardSummary(
        attempts=len(kept),
        penetration=float(outcomes.penetration[kept].max(initial=0.0)),
        fastest=float(outcomes.fastest[kept].max(initial=0.0)),
        displaced=float(way[kept & outcomes.success].max(initial=0.0)),
        dropped={name: int(which.sum()) for name, which in reasons.items()},
    )
