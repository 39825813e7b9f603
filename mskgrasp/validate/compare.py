"""Differences between outcomes under one setting and under the finest, judged by the intrinsic floor."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy import stats

from mskgrasp.core.geometry import wrap_angle
from mskgrasp.validate.convergence import Outcomes

MOST_DISAGREEMENT = 0.03
"""By how much S may agree less often than at the floor."""
MOST_TIMES_FLOOR = 1.5
"""How many times the floor's differences of displacement may be."""
MOST_RATE_DIFFERENCE = 0.02
"""By how much the success rate may differ from that of the finest setting."""
LEAST_P = 0.05
"""Under this the distributions of displacements count as different (after Bonferroni over the axes)."""
NOTICED = (5e-5, 5e-5, 5e-5, 1e-3)
"""Half of what the arm repeats, m and rad: a shift of the distributions that nobody would notice. Most parts
do not rise in the hand, so that a micrometre in dz is significant."""
LEAST_BOTH = 30
"""Grasps that must succeed under both for a comparison."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One setting against the finest; differences are over grasps that succeeded under both.

    Attributes:
        success_rate: Under this setting.
        agreement: Share of grasps whose S is the same.
        shift_median: Median length of the difference of the displacements' translations, m.
        shift_p90: Its 90th percentile, m.
        turn_median: Median difference of the displacements' turns, rad.
        turn_p90: Its 90th percentile, rad.
        p_value: Least p of two-sample Kolmogorov-Smirnov tests of dx, dy, dz, dtheta, times four.
        p_beyond: The same of whether the distributions differ by more than a shift of ``NOTICED``; reported,
            not a criterion.
        bias: Largest mean difference of dx, dy, dz over grasps that succeeded under both, m, without the
            tenth that differs most either way: what is wrong on the whole, not grasp by grasp.
        bias_p: Least p of paired Wilcoxon signed-rank tests of the four differences, times four.
        cpu_ms: Processor time of a grasp, ms.
        n: Grasps.
        n_both: Grasps that succeeded under both.
    """

    success_rate: float
    agreement: float
    shift_median: float
    shift_p90: float
    turn_median: float
    turn_p90: float
    p_value: float
    p_beyond: float
    bias: float
    bias_p: float
    cpu_ms: float
    n: int
    n_both: int

    def as_dict(self) -> dict[str, float | None]:
        """For JSON, which knows no NaN: what is unknown is None."""
        return {key: value if np.isfinite(value) else None for key, value in asdict(self).items()}


def compare(outcomes: Outcomes, reference: Outcomes) -> Comparison:
    """One setting against another, grasp by grasp and as distributions."""
    both = outcomes.success & reference.success
    difference = outcomes.displacement[both] - reference.displacement[both]
    shift = np.linalg.norm(difference[:, :3], axis=1)
    turn = np.abs(wrap_angle(difference[:, 3]))
    ours, theirs = (one.displacement[one.success] for one in (outcomes, reference))
    p = beyond = float("nan")
    if min(len(ours), len(theirs)) > 1:
        with warnings.catch_warnings():
            # Of few and equal values the exact p is not found, and SciPy takes the asymptotic one.
            warnings.filterwarnings("ignore", "ks_2samp: Exact calculation", RuntimeWarning)
            p = min(stats.ks_2samp(ours[:, axis], theirs[:, axis]).pvalue for axis in range(4))  # pyright: ignore[reportAttributeAccessIssue]
        beyond = min(_p_beyond(ours[:, axis], theirs[:, axis], NOTICED[axis]) for axis in range(4))
    return Comparison(
        success_rate=float(outcomes.success.mean()),
        agreement=float((outcomes.success == reference.success).mean()),
        shift_median=_percentile(shift, 50),
        shift_p90=_percentile(shift, 90),
        turn_median=_percentile(turn, 50),
        turn_p90=_percentile(turn, 90),
        p_value=float(np.minimum(1.0, 4 * p)),
        p_beyond=float(np.minimum(1.0, 4 * beyond)),
        bias=_bias(difference),
        bias_p=_bias_p(np.column_stack([difference[:, :3], wrap_angle(difference[:, 3])])),
        cpu_ms=1e3 * float(outcomes.cpu_seconds.mean()),
        n=len(both),
        n_both=int(both.sum()),
    )


def complaints(found: Comparison, floor: Comparison, reference_rate: float) -> list[str]:
    """Why a setting adds something to the floor; empty where it adds nothing."""
    said = []
    if found.n_both < LEAST_BOTH:
        said.append(f"only {found.n_both} grasps succeeded under both, {LEAST_BOTH} are needed to compare")
    if found.agreement < floor.agreement - MOST_DISAGREEMENT:
        said.append(f"S agrees in {found.agreement:.1%}, at the floor in {floor.agreement:.1%}")
    for name, unit, scale in (
        ("shift_median", "mm", 1e3), ("shift_p90", "mm", 1e3),
        ("turn_median", "deg", np.degrees(1)), ("turn_p90", "deg", np.degrees(1)),
    ):  # fmt: skip
        value, least = getattr(found, name), getattr(floor, name)
        if value > MOST_TIMES_FLOOR * least:
            said.append(f"{name.replace('_', ' ')} {scale * value:.2f} {unit}, floor {scale * least:.2f}")
    if abs(found.success_rate - reference_rate) > MOST_RATE_DIFFERENCE:
        said.append(f"success rate {found.success_rate:.1%} instead of {reference_rate:.1%}")
    if found.p_value < LEAST_P:
        said.append(f"displacements are distributed differently (p = {found.p_value:.3f})")
    return said


def cheapest(
    found: dict[str, Comparison], floor: Comparison, reference_rate: float, candidates: Sequence[str]
) -> str | None:
    """The candidate of least processor time that adds nothing to the floor."""
    fit = [name for name in candidates if not complaints(found[name], floor, reference_rate)]
    return min(fit, key=lambda name: found[name].cpu_ms, default=None)


def _p_beyond(ours: np.ndarray, theirs: np.ndarray, margin: float) -> float:
    """P of both one-sided Kolmogorov-Smirnov tests, the samples moved towards each other by a margin."""
    found = []
    for moved, alternative in ((ours - margin, "less"), (ours + margin, "greater")):
        test: Any = stats.ks_2samp(moved, theirs, alternative=alternative, method="asymp")
        found.append(float(test.pvalue))
    return min(1.0, 2 * min(found))


def _bias(difference: np.ndarray) -> float:
    if not len(difference):
        return float("nan")
    return float(np.abs(stats.trim_mean(difference[:, :3], 0.1, axis=0)).max())


def _bias_p(difference: np.ndarray) -> float:
    moved = [axis for axis in difference.T if np.any(axis != 0)]
    found = [float(stats.wilcoxon(axis).pvalue) for axis in moved]  # pyright: ignore[reportAttributeAccessIssue]
    return min(1.0, 4 * min(found, default=1.0))


def _percentile(values: np.ndarray, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else float("nan")
