"""A number that the simulation must reproduce."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Check:
    """One number that the simulation must reproduce.

    Attributes:
        name: Name of the checked quantity.
        formula: Formula of the expected value.
        unit: Unit of the values.
        expected: Value by the formula.
        measured: Value in the simulation.
        low: Least value that passes.
        high: Greatest value that passes.
    """

    name: str
    formula: str
    unit: str
    expected: float
    measured: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether the measured value lies within the tolerance."""
        return bool(self.low <= self.measured <= self.high)

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return asdict(self) | {"passed": self.passed}


def near(name: str, formula: str, unit: str, expected: float, measured: float, share: float) -> Check:
    """A check whose tolerance is a share of the expected value."""
    return within(name, formula, unit, expected, measured, share * abs(expected))


def within(name: str, formula: str, unit: str, expected: float, measured: float, margin: float) -> Check:
    """A check whose tolerance is a margin to either side of the expected value."""
    return Check(
        name=name, formula=formula, unit=unit, expected=expected, measured=measured,
        low=expected - margin, high=expected + margin,
    )  # fmt: skip
