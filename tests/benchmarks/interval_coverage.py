"""Coverage of intervals over parts, on simulated trials: python -m tests.benchmarks.interval_coverage.

Parts differ, and trials of one part are alike. The RMSE: each part has its own scale, lognormal, and the
errors of its trials are the lengths of Student-t vectors with five degrees of freedom. The share: each part
has its own rate, beta-distributed, or lifts always or never (correlation 1). Shown is how often each interval
of 95 % covers the true value of all parts that might be drawn, and its median width.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import norm, t

from mskgrasp.core.metrics import rms_interval, share_interval, wilson_interval
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.report import show

TRIALS = 7
"""Trials of each part."""
PARTS = (5, 10, 20, 35, 85, 130)
SHARE_TRIALS = (5, 30)
SHARE_PARTS = (5, 20, 85, 130)
"""Of the tables of shares, whose intervals cost more."""
SPREADS = (0.25, 0.5, 1.0)
"""Standard deviation of the logarithm of the parts' scales."""
RATES = ((0.99, 0.3), (0.99, 0.6), (0.98, 1.0), (0.95, 0.1), (0.95, 0.3), (0.95, 0.6), (0.7, 0.3))
"""Mean rate of parts, and the correlation of trials of one part."""
_FREEDOM = 5
_DRAWS = 500
_TAIL = 0.025
Interval = tuple[float, float]


def percentile(squares: np.ndarray, rng: np.random.Generator) -> Interval:
    """Of the root mean square by bootstrap over parts, from the mean square of each part (k,)."""
    return _quantiles(_drawn(squares, rng), _TAIL, 1 - _TAIL)


def expanded(squares: np.ndarray, rng: np.random.Generator) -> Interval:
    """The same with the wider percentiles of Hesterberg (2015), as `bootstrap_interval` has them."""
    k = len(squares)
    tail = float(norm.cdf(np.sqrt(k / (k - 1)) * t.ppf(_TAIL, k - 1)))
    return _quantiles(_drawn(squares, rng), tail, 1 - tail)


def bca(squares: np.ndarray, rng: np.random.Generator) -> Interval:
    """Bias-corrected and accelerated (Efron 1987), whole parts drawn and left out."""
    drawn, k = _drawn(squares, rng), len(squares)
    left_out = np.sqrt((squares.sum() - squares) / (k - 1))
    off = left_out.mean() - left_out
    acceleration = float((off**3).sum() / (6 * (off**2).sum() ** 1.5))
    below = float((drawn < np.sqrt(squares.mean())).mean())
    bias = float(norm.ppf(np.clip(below, 1 / len(drawn), 1 - 1 / len(drawn))))
    ends = []
    for tail in (_TAIL, 1 - _TAIL):
        z = bias + float(norm.ppf(tail))
        ends.append(float(norm.cdf(bias + z / max(1 - acceleration * z, 1e-6))))
    return _quantiles(drawn, *ends)


def jackknife(squares: np.ndarray, rng: np.random.Generator) -> Interval:
    """The interval that the programs report."""
    found = rms_interval([np.full(TRIALS, np.sqrt(one)) for one in squares])
    assert found is not None  # `PARTS` are enough
    return found


RMS_METHODS: dict[str, Callable[[np.ndarray, np.random.Generator], Interval]] = {
    "bootstrap, percentile": percentile,
    "bootstrap, expanded": expanded,
    "bootstrap, BCa": bca,
    "t of the logarithm, jackknife": jackknife,
}
SHARE_METHODS: dict[str, Callable[[np.ndarray, np.ndarray], Interval]] = {
    "Wilson, trials": lambda won, tried: wilson_interval(int(won.sum()), int(tried.sum())),
    "beta-binomial, parts": share_interval,
}


def _drawn(squares: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.sqrt(squares[rng.integers(len(squares), size=(_DRAWS, len(squares)))].mean(axis=1))


def _quantiles(values: np.ndarray, low: float, high: float) -> Interval:
    ends = np.quantile(values, [low, high])
    return float(ends[0]), float(ends[1])


def rms_rows(repeats: int, rng: np.random.Generator) -> list[tuple[str | int, ...]]:
    """Rows of the RMSE: spread, number of parts, and each method's coverage and width."""
    rows = []
    for spread in SPREADS:
        true = float(np.sqrt(np.exp(2 * spread**2) * 3 * _FREEDOM / (_FREEDOM - 2)))
        for k in PARTS:
            found: dict[str, list[Interval]] = {name: [] for name in RMS_METHODS}
            for _ in range(repeats):
                scale = np.exp(spread * rng.normal(size=(k, 1)))
                chi = np.sqrt(rng.chisquare(_FREEDOM, (k, TRIALS)) / _FREEDOM)
                errors = scale * np.linalg.norm(rng.normal(size=(k, TRIALS, 3)), axis=2) / chi
                for name, method in RMS_METHODS.items():
                    found[name].append(method((errors**2).mean(axis=1), rng))
            cells = (_cell(np.array(some), true, true) for some in found.values())
            rows.append((f"{spread:g}", k, *cells))
    return rows


def share_rows(repeats: int, rng: np.random.Generator) -> list[tuple[str | int, ...]]:
    """Rows of the share: rate, correlation, trials, parts, and each method's coverage and width."""
    rows = []
    for (rate, alike), trials, k in itertools.product(RATES, SHARE_TRIALS, SHARE_PARTS):
        if alike == 1.0:
            rates = (rng.random((repeats, k)) < rate).astype(float)
        else:
            rates = rng.beta(rate * (1 - alike) / alike, (1 - rate) * (1 - alike) / alike, (repeats, k))
        won, tried = rng.binomial(trials, rates), np.full(k, trials)
        cells = (
            _cell(np.array([method(one, tried) for one in won]), rate, 1.0)
            for method in SHARE_METHODS.values()
        )
        rows.append((f"{rate:g}", f"{alike:g}", trials, k, *cells))
    return rows


def _cell(intervals: np.ndarray, true: float, scale: float) -> str:
    """Share of intervals (n, 2) that cover the truth, and their median width."""
    covered = (intervals[:, 0] <= true) & (true <= intervals[:, 1])
    width = float(np.median(intervals[:, 1] - intervals[:, 0])) / scale
    return f"{covered.mean():.0%}, width {width:.2f}"


def main() -> int:
    """Simulates, prints and stores."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.interval_coverage",
        description="Measure how often intervals over parts cover the truth.",
    )
    parser.add_argument("--out", type=Path, help="folder for report.json and report.md")
    parser.add_argument("--repeats", type=int, default=1000, help="of each row (default 1000)")
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    rms = Table(
        header=("spread of parts", "parts", *RMS_METHODS),
        rows=rms_rows(options.repeats, rng),
        caption="Root mean square; widths relative to it",
    )
    share = Table(
        header=("rate", "correlation", "trials a part", "parts", *SHARE_METHODS),
        rows=share_rows(options.repeats, rng),
        caption="Share of trials",
    )
    n = f"{options.repeats} simulated experiments a row; {TRIALS} trials a part for the RMSE; seed 0"
    show([rms, share], options.out, {"n": n})
    return 0


if __name__ == "__main__":
    sys.exit(main())
