"""Findings from outcomes under several settings: errors by origin, the chosen setting, sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from mskgrasp.core.grasp import MAX_DISPLACEMENT
from mskgrasp.validate.compare import Comparison, compare_outcomes, distances
from mskgrasp.validate.config import (
    DRAWN,
    MOVED,
    NOMINAL,
    NOTHING_SKIPPED,
    Margins,
    ValidateConfig,
    floor_name,
    rounding_name,
    variant_name,
)
from mskgrasp.validate.equivalence import LEAST_PARTS, Equivalence, mean_difference, median_excess
from mskgrasp.validate.outcomes import Outcomes
from tasks.attempt.outcome import MAX_PENETRATION, MAX_SPEED


@dataclass(frozen=True, kw_only=True)
class SettingComparison:
    """A setting against a reference, and whether it is equivalent.

    Attributes:
        setting: Name.
        reference: Name.
        origin: Sources of the difference, in words.
        found: Differences grasp by grasp.
        displacement: Median distance beyond that of the reference's floor, m; None for a floor.
        success: Difference of the success rates; None for a floor.
    """

    setting: str
    reference: str
    origin: str
    found: Comparison
    displacement: Equivalence | None = None
    success: Equivalence | None = None

    @property
    def passed(self) -> bool:
        """Whether both differences are shown to be within their margins."""
        return all(test is not None and test.passed for test in (self.displacement, self.success))

    def complaints(self) -> list[str]:
        """Margins that are exceeded and by how much, in words."""
        said = []
        for what, test, scale, unit in (
            ("median displacement beyond the floor", self.displacement, 1e3, "mm"),
            ("success rate", self.success, 1e2, "points"),
        ):
            if test is None or test.passed:
                continue
            if test.parts < LEAST_PARTS:
                said.append(f"{what}: {test.parts} parts were compared, {LEAST_PARTS} are needed")
            elif not np.isfinite(test.excess):
                said.append(f"{what}: no grasps to compare")
            else:
                said.append(
                    f"{what}: {scale * test.estimate:+.2f} {unit}, the interval {scale * test.low:.2f} .. "
                    f"{scale * test.high:.2f} is {scale * test.excess:.2f} beyond the margin of "
                    f"{scale * test.margin:g}"
                )
        return said

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        tests = {"displacement": self.displacement, "success": self.success}
        return {
            "setting": self.setting,
            "reference": self.reference,
            "origin": self.origin,
            **self.found.to_json(),
            "equivalence": {name: None if test is None else test.to_json() for name, test in tests.items()},
            "equivalent": self.passed,
        }


def compare_with_reference(
    outcomes: Mapping[str, Outcomes], setting: str, reference: str, n: int, margins: Margins, origin: str = ""
) -> SettingComparison:
    """Compares the first n grasps of each part under a setting and a reference.

    Displacements are compared where the reference's floor was simulated, too.
    """
    own, theirs = (_first(outcomes[name], n) for name in (setting, reference))
    settled = own.settled & theirs.settled
    gained = own.success.astype(float) - theirs.success.astype(float)
    tried = outcomes[_floor_of(reference)]
    n_floor = min(n, 1 + int(tried.index.max(initial=-1)))
    near, middle, moved = (_first(one, n_floor) for one in (own, theirs, tried))
    found, floor = distances(near, middle), distances(moved, middle)
    known = near.settled & middle.settled & moved.settled & np.isfinite(found) & np.isfinite(floor)
    return SettingComparison(
        setting=setting,
        reference=reference,
        origin=origin,
        found=compare_outcomes(own, theirs),
        displacement=median_excess(found[known], floor[known], near.part[known], margins.displacement),
        success=mean_difference(gained[settled], own.part[settled], margins.success),
    )


def errors(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> list[SettingComparison]:
    """Differences by origin: chaos, rounding, the steps of the references, those of production."""
    first = config.references[0]
    found = []
    for reference in config.references:
        found.append(
            _bare(outcomes, floor_name(reference.name), reference.name, "chaos: starts moved by 10 um")
        )
        if reference is first:
            name = rounding_name(reference.name)
            found.append(_bare(outcomes, name, reference.name, "rounding, grown by chaos: moved by 0.1 um"))
    for reference in config.references[1:]:
        n = min(config.n_of(reference), config.n_of(first))
        origin = "steps and iterations of the reference, and chaos"
        found.append(compare_with_reference(outcomes, reference.name, first.name, n, config.margins, origin))
    found.append(_bare(outcomes, MOVED, NOMINAL, "chaos: starts moved by 10 um"))
    found.append(_bare(outcomes, NOTHING_SKIPPED, NOMINAL, "skipped air, and chaos"))
    for reference in config.references:
        origin = "steps, iterations, shortcuts of production, and chaos"
        n = config.n_of(reference)
        found.append(compare_with_reference(outcomes, NOMINAL, reference.name, n, config.margins, origin))
    return found


def grid(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> list[SettingComparison]:
    """Every setting of the grid against the first reference, cheapest first."""
    first = config.references[0]
    found = []
    for name in config.candidates():
        key = NOMINAL if name == config.production else name
        own = compare_with_reference(outcomes, key, first.name, config.n_of(first), config.margins)
        found.append(replace(own, setting=name))
    return sorted(found, key=lambda one: one.found.cpu_ms)


def choose(candidates: list[SettingComparison]) -> tuple[str, bool]:
    """The cheapest setting that is equivalent, and True.

    Where none is shown to be: False, and the cheapest one whose estimates, if not their intervals, are within
    the margins; without such a one, that of least excess.
    """
    by_cost = sorted(candidates, key=lambda one: one.found.cpu_ms)
    for one in by_cost:
        if one.passed:
            return one.setting, True
    likely = [one for one in by_cost if _likely(one.displacement) and _likely(one.success)]
    if likely:
        return likely[0].setting, False
    return min(
        by_cost, key=lambda one: one.displacement.excess if one.displacement else np.inf
    ).setting, False


def _likely(test: Equivalence | None) -> bool:
    return test is not None and abs(test.estimate) < test.margin


@dataclass(frozen=True, kw_only=True)
class Varied:
    """A variant against production.

    Attributes:
        group: Quantity that is varied.
        label: Its value.
        found: Differences grasp by grasp.
        parts: Number of parts compared; those that the variant does not change are left out.
    """

    group: str
    label: str
    found: Comparison
    parts: int

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return {"group": self.group, "label": self.label, "parts": self.parts, **self.found.to_json()}


def sensitivity(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> list[Varied]:
    """Every variant against production; before them production with its starts moved."""
    n, nominal = config.n_variants, outcomes[NOMINAL]
    names = [("start", "moved by 10 um", MOVED)]
    for group, labels in config.variants.items():
        names += [(group, label, variant_name(group, label)) for label in labels]
    found = []
    for group, label, name in names:
        own = _first(outcomes[name], n)
        parts = set(own.part.tolist())
        compared = compare_outcomes(own, nominal.of(parts, n))
        found.append(Varied(group=group, label=label, found=compared, parts=len(parts)))
    return found


def label_error(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> dict[str, Any] | None:
    """Differences from production with all uncertain settings drawn together; None without ranges."""
    if not config.ranges:
        return None
    n = config.n_variants
    found = compare_outcomes(_first(outcomes[DRAWN], n), _first(outcomes[NOMINAL], n))
    return {"ranges": {name: list(bounds) for name, bounds in config.ranges.items()}, **found.to_json()}


def size(outcomes: Outcomes) -> dict[str, float]:
    """Size of the displacements themselves: medians and 90th percentiles, m and rad, and the success rate."""
    held = outcomes.displacement[outcomes.success & outcomes.settled]
    way, turn = np.linalg.norm(held[:, :3], axis=1), np.abs(held[:, 3])
    found = {"n": len(outcomes.success), "success_rate": float(outcomes.success[outcomes.settled].mean())}
    for name, values in (("shift", way), ("turn", turn)):
        for share, title in ((50, "median"), (90, "p90")):
            found[f"{name}_{title}"] = float(np.percentile(values, share)) if len(values) else 0.0
    return found


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


def _bare(outcomes: Mapping[str, Outcomes], setting: str, reference: str, origin: str) -> SettingComparison:
    n = 1 + int(outcomes[setting].index.max(initial=-1))
    found = compare_outcomes(outcomes[setting], _first(outcomes[reference], n))
    return SettingComparison(setting=setting, reference=reference, origin=origin, found=found)


def _floor_of(reference: str) -> str:
    return MOVED if reference == NOMINAL else floor_name(reference)


def _first(outcomes: Outcomes, n: int) -> Outcomes:
    return outcomes.of(np.unique(outcomes.part).tolist(), n)
