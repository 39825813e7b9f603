"""Comparison of production with references, coarser settings and variants: all that is stored of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from mskgrasp.validate.config import NOMINAL, ValidateConfig
from mskgrasp.validate.discards import DiscardSummary, summarise_discards
from mskgrasp.validate.findings import (
    DisplacementSize,
    DrawnComparison,
    SettingComparison,
    Varied,
    choose,
    errors,
    grid,
    label_error,
    sensitivity,
    size,
)
from mskgrasp.validate.outcomes import Outcomes


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Setting chosen from the grid.

    Attributes:
        setting: Its name.
        shown: Whether it is shown to be equivalent to the reference.
        production_fails: Margins that production does not keep, in words.
    """

    setting: str
    shown: bool
    production_fails: list[str]


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """Findings from the outcomes under all settings.

    Attributes:
        production: Name of production's setting.
        yardstick: Name of the first reference.
        size: Size of production's displacements.
        errors: Differences by origin.
        grid: Every setting of the grid against the first reference, cheapest first.
        choice: The setting chosen from the grid.
        sensitivity: Variants against production.
        label_error: Hand and table drawn from their ranges, against production; None without ranges.
        impossible: Production's attempts that are no labels.
    """

    production: str
    yardstick: str
    size: DisplacementSize
    errors: list[SettingComparison]
    grid: list[SettingComparison]
    choice: Choice
    sensitivity: list[Varied]
    label_error: DrawnComparison | None
    impossible: DiscardSummary

    def to_json(self) -> dict[str, Any]:
        """Convert to a part of the content of ``validate.json``."""
        return {
            "production": self.production,
            "yardstick": self.yardstick,
            "size": self.size.to_json(),
            "errors": [one.to_json() for one in self.errors],
            "grid": [one.to_json() for one in self.grid],
            "choice": asdict(self.choice),
            "sensitivity": [one.to_json() for one in self.sensitivity],
            "label_error": None if self.label_error is None else self.label_error.to_json(),
            "impossible": self.impossible.to_json(),
        }


def measure_convergence(config: ValidateConfig, outcomes: Mapping[str, Outcomes]) -> Convergence:
    """Compare the outcomes under all settings."""
    compared = grid(config, outcomes)
    setting, shown = choose(compared, config.candidates())
    own = next(one for one in compared if one.setting == config.production)
    return Convergence(
        production=config.production,
        yardstick=config.references[0].name,
        size=size(outcomes[NOMINAL]),
        errors=errors(config, outcomes),
        grid=compared,
        choice=Choice(setting=setting, shown=shown, production_fails=own.complaints()),
        sensitivity=sensitivity(config, outcomes),
        label_error=label_error(config, outcomes),
        impossible=summarise_discards(outcomes[NOMINAL]),
    )
