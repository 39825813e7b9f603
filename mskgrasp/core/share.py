"""Share of trials that count, with an interval that knows about trials of the same part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mskgrasp.core.metrics import share_interval


@dataclass(frozen=True, kw_only=True)
class Share:
    """A share of trials.

    Attributes:
        n: Number that count.
        of: Number of trials.
        value: The share; 0 of no trial.
        interval: 95 %, over parts, since trials of one part are alike (`share_interval`).
    """

    n: int
    of: int
    value: float
    interval: tuple[float, float]

    @classmethod
    def count(cls, hits: Sequence[bool] | np.ndarray, parts: Sequence[str]) -> Share:
        """Share of trials (n,) that count, with the part of each."""
        n, of = int(np.sum(hits)), len(parts)
        _, which = np.unique(np.asarray(parts, dtype=str), return_inverse=True)
        interval = share_interval(np.bincount(which, weights=hits), np.bincount(which))
        return cls(n=n, of=of, value=n / of if of else 0.0, interval=interval)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return dict(n=self.n, of=self.of, share=self.value, interval=list(self.interval))

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Share:
        """The share that `to_json` converted."""
        low, high = values["interval"]
        return cls(n=values["n"], of=values["of"], value=values["share"], interval=(low, high))
