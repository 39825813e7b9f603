"""Equivalence of paired outcomes by two one-sided tests, with parts as clusters.

A setting is equivalent to another if both one-sided hypotheses, that it differs by at least the margin
upwards or downwards, are rejected at 5 %: the 90 % interval of the difference lies within the margins
(Schuirmann, J. Pharmacokinetics and Biopharmaceutics 15, 1987). Grasps of one part are not independent of
each other: parts are the sampling units.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy import stats

ALPHA = 0.05
LEAST_PARTS = 10
"""With fewer clusters neither interval keeps its level."""
REPLICATES = 2000


@dataclass(frozen=True, kw_only=True)
class Equivalence:
    """A difference and its 90 % interval, against a margin.

    Attributes:
        estimate: The difference.
        low: Lower end of the interval.
        high: Upper end.
        margin: Largest difference, either way, that counts as none.
        n: Grasps that were compared.
        parts: Parts that they belong to.
    """

    estimate: float
    low: float
    high: float
    margin: float
    n: int
    parts: int

    @property
    def passed(self) -> bool:
        """Whether the interval lies within the margins, and enough parts were compared."""
        return self.parts >= LEAST_PARTS and self.excess < 0

    @property
    def excess(self) -> float:
        """Distance by which the interval exceeds the margin; negative where it lies within."""
        worst = max(self.high, -self.low)
        return worst - self.margin if math.isfinite(worst) else math.inf

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values; NaN, which JSON does not have, becomes None."""
        values = asdict(self) | {"excess": self.excess}
        known = {key: value if math.isfinite(value) else None for key, value in values.items()}
        return known | {"passed": self.passed}


def median_excess(
    found: np.ndarray, floor: np.ndarray, part: np.ndarray, margin: float, replicates: int = REPLICATES
) -> Equivalence:
    """Excess of the median of paired distances over that of the floor's distances.

    The interval is that of the percentile bootstrap over parts.

    Args:
        found: (n,) distance between the outcomes of each grasp under a setting and under the reference.
        floor: (n,) the same between the reference with its start moved and the reference.
        part: (n,) part of each grasp.
        margin: In the unit of the distances.
        replicates: Number of replicates of the bootstrap.
    """
    names, which = np.unique(part, return_inverse=True)
    if len(names) < 2:
        return _unknown(margin, len(part), len(names))
    own = [np.flatnonzero(which == k) for k in range(len(names))]
    rng = np.random.default_rng(0)
    drawn = np.empty(replicates)
    for k in range(replicates):
        rows = np.concatenate([own[i] for i in rng.integers(len(own), size=len(own))])
        drawn[k] = np.median(found[rows]) - np.median(floor[rows])
    low, high = np.quantile(drawn, (ALPHA, 1 - ALPHA))
    return Equivalence(
        estimate=float(np.median(found) - np.median(floor)), low=float(low), high=float(high),
        margin=margin, n=len(part), parts=len(names),
    )  # fmt: skip


def mean_difference(difference: np.ndarray, part: np.ndarray, margin: float) -> Equivalence:
    """The mean of paired differences of success, each -1, 0 or 1.

    The interval is Student's with the cluster-robust standard error, to which one gain and one loss are added
    (as by Agresti and Min, Statistics in Medicine 24, 2005: few differences make the error too small), and no
    narrower than what n grasps without any difference exclude at 5 % (the "rule of three").

    Args:
        difference: (n,) success under a setting minus success under the reference.
        part: (n,) part of each grasp.
        margin: Margin of the success rate, as a share.
    """
    names, which = np.unique(part, return_inverse=True)
    n, k = len(difference), len(names)
    if k < 2:
        return _unknown(margin, n, k)
    mean = float(difference.mean())
    sums = np.bincount(which, weights=difference - mean)
    error = math.sqrt(k / (k - 1) * float((sums**2).sum()) + 2) / n
    half = max(error * float(stats.t.ppf(1 - ALPHA, k - 1)), 1 - ALPHA ** (1 / n))
    return Equivalence(
        estimate=mean, low=max(-1.0, mean - half), high=min(1.0, mean + half), margin=margin, n=n, parts=k
    )


def _unknown(margin: float, n: int, parts: int) -> Equivalence:
    nan = float("nan")
    return Equivalence(estimate=nan, low=nan, high=nan, margin=margin, n=n, parts=parts)
