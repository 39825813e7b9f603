"""Summary of placements in numbers: counts and errors by correction, and the gain of correcting."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mskgrasp.core.metrics import bootstrap_interval
from mskgrasp.palletize.placement_records import CORRECTIONS, Correction, Placement

SCHEMA_VERSION = 1

Interval = tuple[float, float]
Group = dict[Correction, Placement]
"""Placements of one part, trial and slot, by correction."""
_ERRORS = ("translation", "rotation")


@dataclass(frozen=True, kw_only=True)
class CorrectionStatistics:
    """Counts and median errors under one correction; metres and radians.

    The medians are of the compared placements; None without one. Intervals of 95 % by bootstrap over parts;
    None for a single part.
    """

    tried: int
    placed: int
    measured: int
    reasons: dict[str, int]
    median_translation: float | None
    median_translation_interval: Interval | None
    median_rotation: float | None
    median_rotation_interval: Interval | None


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Median errors with a correction relative to those without; None without a compared placement."""

    translation_ratio: float | None
    translation_ratio_interval: Interval | None
    rotation_ratio: float | None
    rotation_ratio_interval: Interval | None


@dataclass(frozen=True, kw_only=True)
class PartMedians:
    """Median errors of one part by correction; metres and radians, None without a compared placement."""

    compared: int
    median_translation: dict[Correction, float | None]
    median_rotation: dict[Correction, float | None]


@dataclass(frozen=True, kw_only=True)
class PlacementSummary:
    """Numbers of a palletizing run.

    Attributes:
        corrections: Statistics by correction.
        compared: Number of placements measured under every correction (`compared_groups`).
        parts_compared: Number of their parts.
        gain: Gain of each correction.
        parts: Medians by part.
    """

    schema_version: int = SCHEMA_VERSION
    corrections: dict[Correction, CorrectionStatistics]
    compared: int
    parts_compared: int
    gain: dict[Correction, Gain]
    parts: dict[str, PartMedians]

    def to_json(self) -> dict[str, Any]:
        """Convert to the content of ``report.json``."""
        return asdict(self)


def compared_groups(placements: Sequence[Placement]) -> list[Group]:
    """Find the placements of one part, trial and slot that were measured under every correction tried.

    A part lost under one correction does not count under the others; otherwise the correction that loses the
    difficult parts would seem the best.
    """
    tried = {one.correction for one in placements}
    groups: dict[tuple[str, int, int], Group] = {}
    for one in placements:
        if one.translation_error is not None:
            groups.setdefault(one.key[:3], {})[one.correction] = one
    return [group for _, group in sorted(groups.items()) if set(group) == tried]


def group_part(group: Group) -> str:
    """The part of a group of placements."""
    return next(iter(group.values())).part


def corrections_of(placements: Sequence[Placement]) -> list[Correction]:
    """The corrections that were tried, in their order."""
    tried = {one.correction for one in placements}
    return [name for name in CORRECTIONS if name in tried]


def summarise_placements(placements: Sequence[Placement]) -> PlacementSummary:
    """Summarise placements."""
    tried = corrections_of(placements)
    groups = compared_groups(placements)
    return PlacementSummary(
        corrections={
            name: _statistics([one for one in placements if one.correction == name], groups, name)
            for name in tried
        },
        compared=len(groups),
        parts_compared=len({group_part(group) for group in groups}),
        gain={name: _gain(groups, name) for name in tried if name != "none" and "none" in tried},
        parts={
            part: _part_medians([group for group in groups if group_part(group) == part], tried)
            for part in sorted({one.part for one in placements})
        },
    )


def _statistics(
    placements: Sequence[Placement], groups: list[Group], name: Correction
) -> CorrectionStatistics:
    translation, rotation = (_over_parts(groups, error, (name,), _median) for error in _ERRORS)
    return CorrectionStatistics(
        tried=len(placements),
        placed=sum(one.placed for one in placements),
        measured=sum(one.translation_error is not None for one in placements),
        reasons=dict(sorted(Counter(one.reason for one in placements if one.reason).items())),
        median_translation=translation[0],
        median_translation_interval=translation[1],
        median_rotation=rotation[0],
        median_rotation_interval=rotation[1],
    )


def _gain(groups: list[Group], name: Correction) -> Gain:
    translation, rotation = (_over_parts(groups, error, (name, "none"), _ratio) for error in _ERRORS)
    return Gain(
        translation_ratio=translation[0],
        translation_ratio_interval=translation[1],
        rotation_ratio=rotation[0],
        rotation_ratio_interval=rotation[1],
    )


def _part_medians(groups: list[Group], tried: Sequence[Correction]) -> PartMedians:
    def medians(error: str) -> dict[Correction, float | None]:
        return {name: _over_parts(groups, error, (name,), _median)[0] for name in tried}

    return PartMedians(
        compared=len(groups), median_translation=medians("translation"), median_rotation=medians("rotation")
    )


def _over_parts(
    groups: list[Group], error: str, names: tuple[Correction, ...], statistic: Callable[[np.ndarray], float]
) -> tuple[float | None, Interval | None]:
    """A statistic of the errors (n, k) under k corrections, and its interval over parts."""
    rows: dict[str, list[list[float]]] = {}
    for group in groups:
        values = [getattr(group[name], f"{error}_error") for name in names]
        rows.setdefault(group_part(group), []).append(values)
    by_part = [np.array(values) for values in rows.values()]
    if not by_part:
        return None, None
    interval = bootstrap_interval(by_part, statistic) if len(by_part) > 1 else None
    return statistic(np.concatenate(by_part)), interval


def _median(values: np.ndarray) -> float:
    return float(np.median(values))


def _ratio(values: np.ndarray) -> float:
    return float(np.median(values[:, 0]) / max(float(np.median(values[:, 1])), 1e-12))
