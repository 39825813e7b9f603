"""Quantities of a report as text: lengths, angles, intervals, counts; a dash for None."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

_UNKNOWN = 100.0
"""An upper end of an interval of more than this many times the value, as of two parts, is shown as inf."""


def millimetres(value: float | None, interval: Sequence[float] | None = None) -> str:
    """A length, metres, with its interval, if any."""
    return _unit(value, interval, 1e3, "mm")


def degrees(value: float | None, interval: Sequence[float] | None = None) -> str:
    """An angle, radians, with its interval, if any."""
    return _unit(value, interval, 180 / np.pi, "deg")


def counted(counts: Mapping[str, int]) -> str:
    """Counts by name, as in ``missed 2, slipped 1``."""
    return ", ".join(f"{name} {n}" for name, n in counts.items())


def _unit(value: float | None, interval: Sequence[float] | None, scale: float, unit: str) -> str:
    if value is None:
        return "-"
    around = ""
    if interval is not None:
        low, high = interval
        end = "inf" if high > _UNKNOWN * abs(value) > 0 else f"{high * scale:.1f}"
        around = f" [{low * scale:.1f}, {end}]"
    return f"{value * scale:.1f} {unit}{around}"
