"""Differences between outcomes of the same grasps under two settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy import stats

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.validate.outcomes import Outcomes


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One setting against another; differences are over grasps that succeeded under both.

    Attributes:
        success_rate: Under this setting.
        agreement: Share of grasps whose S is the same.
        shift_median: Median length of the difference of the displacements' translations, m.
        shift_p90: Its 90th percentile, m.
        turn_median: Median difference of the displacements' turns, rad.
        turn_p90: Its 90th percentile, rad.
        bias: Largest mean difference of dx, dy, dz over grasps that succeeded under both, m, without the
            tenth that differs most either way: the systematic error.
        cpu_ms: Processor time of a grasp, ms.
        n: Grasps whose part was at rest under both.
        n_both: Grasps that succeeded under both.
    """

    success_rate: float
    agreement: float
    shift_median: float
    shift_p90: float
    turn_median: float
    turn_p90: float
    bias: float
    cpu_ms: float
    n: int
    n_both: int

    def to_json(self) -> dict[str, float | None]:
        """Convert to plain values; NaN, which JSON does not have, becomes None."""
        return {key: value if np.isfinite(value) else None for key, value in asdict(self).items()}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Comparison:
        """The inverse of `to_json`."""
        known: dict[str, Any] = {key: np.nan if value is None else value for key, value in values.items()}
        return cls(**known)


def compare_outcomes(outcomes: Outcomes, reference: Outcomes) -> Comparison:
    """One setting against another, grasp by grasp; both hold the same grasps."""
    settled = outcomes.settled & reference.settled
    both = settled & outcomes.success & reference.success
    difference = outcomes.displacement[both] - reference.displacement[both]
    shift = np.linalg.norm(difference[:, :3], axis=1)
    turn = np.abs(wrap_angle(difference[:, 3]))
    return Comparison(
        success_rate=_mean(outcomes.success[settled]),
        agreement=_mean((outcomes.success == reference.success)[settled]),
        shift_median=percentile(shift, 50),
        shift_p90=percentile(shift, 90),
        turn_median=percentile(turn, 50),
        turn_p90=percentile(turn, 90),
        bias=float(np.abs(stats.trim_mean(difference[:, :3], 0.1, axis=0)).max()) if len(shift) else np.nan,
        cpu_ms=1e3 * _mean(outcomes.cpu_seconds),
        n=int(settled.sum()),
        n_both=int(both.sum()),
    )


def distances(outcomes: Outcomes, reference: Outcomes) -> np.ndarray:
    """(n,) length of the difference of each grasp's translations, m; NaN unless it succeeded under both."""
    return np.linalg.norm((outcomes.displacement - reference.displacement)[:, :3], axis=1)


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else float("nan")


def percentile(values: np.ndarray, share: float) -> float:
    """Percentile of values (n,); NaN without any."""
    return float(np.percentile(values, share)) if len(values) else float("nan")
