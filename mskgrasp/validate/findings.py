"""Findings from outcomes under several settings: errors by origin, the chosen setting, sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from mskgrasp.validate.compare import Comparison, compare_outcomes, distances, percentile
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
                said.append(f"{what}: not shown by fewer than {LEAST_PARTS} parts (here {test.parts})")
            elif not np.isfinite(test.excess):
                said.append(f"{what}: no grasps to compare")
            else:
                said.append(
                    f"{what}: {scale * test.estimate:+z.2f} {unit}, the interval {scale * test.low:.2f} .. "
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
    """Compare the first n grasps of each part under a setting and a reference.

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


def choose(compared: list[SettingComparison], candidates: Mapping[str, tuple[int, int]]) -> tuple[str, bool]:
    """The cheapest setting that is equivalent, and True.

    All finer ones must be, too: near the margin a coarse setting may pass by the luck of the draw. Where none
    is shown to be: False, and the cheapest one whose estimates, if not their intervals, are within the
    margins; without such a one, that of least excess.

    Args:
        compared: The settings against the reference.
        candidates: Their rates and iterations by name.
    """
    by_cost = sorted(compared, key=lambda one: one.found.cpu_ms)
    failed = [candidates[one.setting] for one in compared if not one.passed]
    for one in by_cost:
        rate, iterations = candidates[one.setting]
        if not any(finer >= rate and more >= iterations for finer, more in failed):
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
    names += [(group, label, variant_name(group, label)) for group, label, _ in config.tried_variants()]
    found = []
    for group, label, name in names:
        own = _first(outcomes[name], n)
        parts = set(own.part.tolist())
        compared = compare_outcomes(own, nominal.of(parts, n))
        found.append(Varied(group=group, label=label, found=compared, parts=len(parts)))
    return found


@dataclass(frozen=True, kw_only=True)
class DrawnComparison:
    """Hand and table drawn from their ranges, against production.

    Attributes:
        ranges: Least and greatest value of each setting drawn.
        found: Differences grasp by grasp.
    """

    ranges: dict[str, tuple[float, float]]
    found: Comparison

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values."""
        return {
            "ranges": {name: list(bounds) for name, bounds in self.ranges.items()},
            **self.found.to_json(),
        }


def label_error(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> DrawnComparison | None:
    """Differences from production with all uncertain settings drawn together; None without ranges."""
    if not config.ranges:
        return None
    n = config.n_variants
    found = compare_outcomes(_first(outcomes[DRAWN], n), _first(outcomes[NOMINAL], n))
    return DrawnComparison(ranges=dict(config.ranges), found=found)


@dataclass(frozen=True, kw_only=True)
class DisplacementSize:
    """Size of the displacements themselves, and the success rate.

    Attributes:
        n: Number of attempts.
        success_rate: Of those whose part was at rest.
        shift_median: Median length of the translations, m.
        shift_p90: Its 90th percentile, m.
        turn_median: Median turn, rad.
        turn_p90: Its 90th percentile, rad.
    """

    n: int
    success_rate: float
    shift_median: float
    shift_p90: float
    turn_median: float
    turn_p90: float

    def to_json(self) -> dict[str, Any]:
        """Convert to plain values; NaN, which JSON does not have, becomes None."""
        return {key: value if np.isfinite(value) else None for key, value in asdict(self).items()}


def size(outcomes: Outcomes) -> DisplacementSize:
    """Measure the displacements of the successes; without any they are NaN."""
    held = outcomes.displacement[outcomes.success & outcomes.settled]
    shift, turn = np.linalg.norm(held[:, :3], axis=1), np.abs(held[:, 3])
    return DisplacementSize(
        n=len(outcomes.success),
        success_rate=float(outcomes.success[outcomes.settled].mean()),
        shift_median=percentile(shift, 50),
        shift_p90=percentile(shift, 90),
        turn_median=percentile(turn, 50),
        turn_p90=percentile(turn, 90),
    )


def _bare(outcomes: Mapping[str, Outcomes], setting: str, reference: str, origin: str) -> SettingComparison:
    n = 1 + int(outcomes[setting].index.max(initial=-1))
    found = compare_outcomes(outcomes[setting], _first(outcomes[reference], n))
    return SettingComparison(setting=setting, reference=reference, origin=origin, found=found)


def _floor_of(reference: str) -> str:
    return MOVED if reference == NOMINAL else floor_name(reference)


def _first(outcomes: Outcomes, n: int) -> Outcomes:
    return outcomes.of(np.unique(outcomes.part).tolist(), n)
