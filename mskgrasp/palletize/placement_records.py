"""Outcomes of placements and their statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from mskgrasp.core.metrics import bootstrap_interval

Correction = Literal["none", "predicted", "truth"]
CORRECTIONS: tuple[Correction, Correction, Correction] = ("none", "predicted", "truth")
GOAL = 0.5
"""The correction is meant to leave no more than this share of the median error."""
_ERRORS = ("translation", "rotation")
_WORDS = {"predicted": "the prediction", "truth": "the truth"}


@dataclass(frozen=True, kw_only=True)
class Placement:
    """What came of one part put down once; metres and radians.

    Attributes:
        part: Name of the part.
        number: Which trial of the part, or which pallet.
        slot: Which slot, from 0.
        correction: What was corrected by.
        target: x, y of the centre and direction of the longer side that were asked for, base frame.
        placed: The part was let go at the target.
        reason: Why not; empty where it was.
        grasp: (4,) the grasp; None, as what follows, where there was none.
        predicted: (4,) expected displacement of the part's seen centre in the hand.
        measured: (4,) the true one; None where nothing tracks the part.
        translation_error: Distance of the placed part's centre from its target; None where not placed, or not
            measured.
        rotation_error: Its turn's error, not negative; None as before.
        unmeasured: Why a placed part's errors are unknown; empty where they are known.
    """

    part: str
    number: int
    slot: int
    correction: Correction
    target: tuple[float, float, float]
    placed: bool
    reason: str
    grasp: list[float] | None = None
    predicted: list[float] | None = None
    measured: list[float] | None = None
    translation_error: float | None = None
    rotation_error: float | None = None
    unmeasured: str = ""

    @property
    def key(self) -> tuple[str, int, int, Correction]:
        """What tells it from all others of a run."""
        return self.part, self.number, self.slot, self.correction

    @property
    def name(self) -> str:
        """The same for a file."""
        return f"{self.part}-{self.number:03d}-{self.slot:02d}-{self.correction}"

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Placement:
        """The placement that `to_json` wrote."""
        x, y, theta = values["target"]
        rest: dict[str, Any] = {name: value for name, value in values.items() if name != "target"}
        return cls(target=(x, y, theta), **rest)


def compared(placements: Sequence[Placement]) -> list[dict[Correction, Placement]]:
    """Placements of one part, trial and slot that were measured under every correction that was tried.

    A part that is lost under one correction must not count under the others, or the easy ones decide.
    """
    tried = {one.correction for one in placements}
    groups: dict[tuple[str, int, int], dict[Correction, Placement]] = {}
    for one in placements:
        if one.translation_error is not None:
            groups.setdefault(one.key[:3], {})[one.correction] = one
    return [group for _, group in sorted(groups.items()) if set(group) == tried]


def corrections_of(placements: Sequence[Placement]) -> list[Correction]:
    """The corrections that were tried, in their order."""
    tried = {one.correction for one in placements}
    found: list[Correction] = [name for name in CORRECTIONS if name in tried]
    return found


def summarise_placements(placements: Sequence[Placement]) -> dict[str, Any]:
    """Counts and errors of each correction, of all parts and of each, and what correcting gains.

    Medians, with intervals by a bootstrap over parts, are of the placements `compared` finds. Without one
    they are absent (None), not zero.
    """
    tried = corrections_of(placements)
    groups = compared(placements)
    parts = sorted({one.part for one in placements})
    return dict(
        schema_version=1,
        corrections={
            name: _counts([one for one in placements if one.correction == name]) | _errors(groups, name)
            for name in tried
        },
        compared=len(groups),
        parts_compared=len({next(iter(group.values())).part for group in groups}),
        gain={name: _gain(groups, name) for name in tried if name != "none" and "none" in tried},
        parts={
            part: _part([g for g in groups if next(iter(g.values())).part == part], tried) for part in parts
        },
    )


def _counts(placements: Sequence[Placement]) -> dict[str, Any]:
    reasons = sorted({one.reason for one in placements if one.reason})
    return dict(
        tried=len(placements),
        placed=sum(one.placed for one in placements),
        measured=sum(one.translation_error is not None for one in placements),
        reasons={reason: sum(one.reason == reason for one in placements) for reason in reasons},
    )


def _errors(groups: list[dict[Correction, Placement]], name: Correction) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for error in _ERRORS:
        by_part = _by_part(groups, error, (name,))
        values = np.concatenate(by_part) if by_part else np.empty((0, 1))
        found[f"median_{error}"] = _median(values) if len(values) else None
        found[f"median_{error}_interval"] = _interval(by_part, _median)
    return found


def _gain(groups: list[dict[Correction, Placement]], name: Correction) -> dict[str, Any]:
    """Median error with a correction, as a share of that without."""
    found: dict[str, Any] = {}
    for error in _ERRORS:
        by_part = _by_part(groups, error, (name, "none"))
        found[f"{error}_ratio"] = _ratio(np.concatenate(by_part)) if by_part else None
        found[f"{error}_ratio_interval"] = _interval(by_part, _ratio)
    return found


def _part(groups: list[dict[Correction, Placement]], tried: Sequence[Correction]) -> dict[str, Any]:
    return dict(
        compared=len(groups),
        **{
            f"median_{error}": {
                name: float(np.median([_value(group[name], error) for group in groups])) if groups else None
                for name in tried
            }
            for error in _ERRORS
        },
    )


def _value(placement: Placement, error: str) -> float:
    return getattr(placement, f"{error}_error")


def _by_part(
    groups: list[dict[Correction, Placement]], error: str, names: tuple[Correction, ...]
) -> list[np.ndarray]:
    """Errors (n_i, k) of each part under k corrections."""
    rows: dict[str, list[list[float]]] = {}
    for group in groups:
        part = next(iter(group.values())).part
        rows.setdefault(part, []).append([_value(group[name], error) for name in names])
    return [np.array(values) for values in rows.values()]


def _median(values: np.ndarray) -> float:
    return float(np.median(values))


def _ratio(values: np.ndarray) -> float:
    return float(np.median(values[:, 0]) / max(float(np.median(values[:, 1])), 1e-12))


def _interval(by_part: list[np.ndarray], statistic: Any) -> list[float] | None:
    """Over parts; of a single one nothing can be said."""
    return list(bootstrap_interval(by_part, statistic)) if len(by_part) > 1 else None


def gain_lines(report: dict[str, Any]) -> list[str]:
    """What correcting gains, in sentences."""
    if not report["compared"]:
        return ["No placement was measured under every correction: errors are unknown."]
    n, parts = report["compared"], report["parts_compared"]
    lines = [f"Medians are of {n} placements of {parts} parts, those measured under every correction."]
    for name, gain in report["gain"].items():
        ratio, turn = (_share(gain, error) for error in _ERRORS)
        text = f"Corrected by {_WORDS[name]}, the median error is {ratio} of that without, the turn's {turn}"
        if name == "predicted":
            met = gain["translation_ratio"] <= GOAL
            text += f"; the goal is {GOAL:g} at most: {'met' if met else 'not met'}"
        lines.append(text + ".")
    return lines


def _share(gain: dict[str, Any], error: str) -> str:
    text, interval = f"{gain[f'{error}_ratio']:.2f}", gain[f"{error}_ratio_interval"]
    return text if interval is None else f"{text} ({interval_text(interval, 1)})"


def millimetres(value: float | None) -> str:
    """A length for people; a dash where it is unknown."""
    return "-" if value is None else f"{value * 1e3:.1f} mm"


def degrees(value: float | None) -> str:
    """An angle for people; a dash where it is unknown."""
    return "-" if value is None else f"{np.degrees(value):.1f} deg"


def interval_text(interval: Sequence[float] | None, scale: float) -> str:
    """An interval for people; a dash where it is unknown."""
    if interval is None:
        return "-"
    digits = 2 if scale == 1 else 1
    return " - ".join(f"{value * scale:.{digits}f}" for value in interval)
