"""Configuration of a validation: settings under test, parts, references and variants."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from pydantic import Field, ValidationError, model_validator

from mskgrasp.core.config import Config, check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.settings import Physics
from mskgrasp.core.settings.physics import LEAST_RATE_HZ, MOST_ITERATIONS

Engine = Literal["sapien", "mujoco"]

SHIFT = 1e-5
"""Shift of the starts of a floor, m: less than any camera or arm could resolve."""
CELL_SHIFT = 1e-4
"""The same for engines that are compared, m: the repeatability of a Panda (ISO 9283, data sheet)."""
ROUNDING = 1e-7
"""The same for the floor of rounding, m: ten float32 numbers at 0.1 m are that far apart."""
FINGER_MASS = 0.015
"""Mass of a finger of the Panda without its motor, kg."""

NOMINAL, MOVED, NOTHING_SKIPPED = (
    "production",
    "production, starts moved by 10 um",
    "production, nothing skipped",
)
DRAWN = "all drawn together"

Value = float | bool | str
JOINED_MM = {"0.1 mm": 0.1, "0.3 mm": 0.3, "0.7 mm": 0.7}
"""Hulls joined while 95 % of the surface stays within this distance, mm."""
FILLED_MM = {"bores open": 0.0, "bores filled": 1e3}
"""Exact hulls, in which bores of plates up to this radius are filled, mm."""
HULLS = ("exact", *JOINED_MM, *FILLED_MM)
RESTS = ("hulls", "mesh")


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Settings of one simulation of the grasps.

    Attributes:
        name: Name in tables and files.
        physics: Settings of the physics.
        n: Number of grasps of each part that are tried.
        shift: Shift of the parts' starts on the table, m; 0 except for the floors.
        density: Density of the parts divided by their own.
        hulls: Hulls of the parts, one of `HULLS`; empty: their own.
        rest: The parts start in the resting poses of their "hulls" or of their "mesh".
        ranges: Physics settings drawn for each grasp, uniformly between two bounds.
        engine: Simulator of the attempts.
    """

    name: str
    physics: Physics
    n: int
    shift: float = 0.0
    engine: Engine = "sapien"
    density: float = 1.0
    hulls: str = ""
    rest: str = "hulls"
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)


class Reference(Config):
    """Simulation finer than production, nothing skipped and nothing coarse."""

    rate_hz: int
    """Steps a second."""
    position_iterations: int = Field(le=MOST_ITERATIONS)
    """Solver iterations a step."""
    grasps_per_part: int = Field(ge=1)
    """Grasps of each part; at most as many are compared with it."""
    floor_grasps_per_part: int = Field(ge=1)
    """Grasps of each part that are tried again with their starts moved. Success rates are compared without
    a floor."""

    @property
    def name(self) -> str:
        """Name in tables."""
        return setting_name(self.rate_hz, self.position_iterations)


class Margins(Config):
    """Differences that count as zero, fixed before anything is measured."""

    displacement: float = Field(default=2.5e-4, gt=0)
    """Margin of the median distance between displacements, beyond that of the reference's floor, m."""
    success: float = Field(default=0.02, gt=0)
    """Margin of the success rate."""


class ValidateConfig(Config):
    """Settings of a validation."""

    out: Path = Path("out/validate")
    """Folder of the report and of the outcomes, from which a stopped run resumes."""
    parts: tuple[str, ...] = ()
    """Names or folders of parts, or sets: starter, catalogue, train, validation, test, new_sizes; empty:
    starter."""
    grasps_per_part: int = Field(default=20, ge=1, le=100_000)
    """Grasps of each part that are drawn, and tried under production's setting; no setting gets more."""
    variant_grasps_per_part: int = Field(default=8, ge=1)
    """Grasps of each part that are tried under each variant."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines the starts and grasps."""
    workers: int = Field(default=0, ge=0)
    """Processes; 0: one for each core."""
    references: Annotated[tuple[Reference, ...], tyro.conf.Suppress] = (
        Reference(rate_hz=2000, position_iterations=100, grasps_per_part=20, floor_grasps_per_part=8),
        Reference(rate_hz=4000, position_iterations=100, grasps_per_part=4, floor_grasps_per_part=4),
    )
    """References that production is compared with, each with its own floors. The grid is compared with the
    first; the others show how far the first has converged."""
    margins: Annotated[Margins, tyro.conf.Suppress] = Margins()
    """Margins of the tests of equivalence."""
    rates_hz: tuple[int, ...] = (250, 500, 1000)
    """Simulation rates of the grid from which production's setting is chosen."""
    iterations: tuple[int, ...] = (15, 25, 50)
    """Solver iterations of the grid."""
    variants: Annotated[dict[str, dict[str, dict[str, Value]]], tyro.conf.Suppress] = {}
    """Variants, by a group and a label for the table: values of physics settings, ``density`` (a
    factor), ``hulls`` or ``rest`` (mesh). Each is compared with production on the same grasps; those that
    lift at a higher rate than production's are left out."""
    ranges: Annotated[dict[str, tuple[float, float]], tyro.conf.Suppress] = {}
    """Physics settings of the hand and the table that are uncertain: drawn together, uniformly, for
    each grasp, they give the error of a label. The fingers' damping stays critical."""
    engine: Engine = "sapien"
    """mujoco: compare the settings under test with a second engine, and nothing else; needs ``[mujoco]``."""
    convergence: bool = True
    """Whether grasps are compared under other settings; without, the checks take two minutes."""
    physics: Physics = Physics()
    """The settings under test: production's."""

    @model_validator(mode="after")
    def _check(self) -> ValidateConfig:
        if self.engine == "sapien" and not self.physics.friction_table_part > 0:
            raise ValueError(
                "physics.friction_table_part must be above 0: closed-form checks slide on the table"
            )
        if not self.physics.friction_pad_part > 0:
            raise ValueError("physics.friction_pad_part must be above 0: without friction nothing is held")
        if not self.rates_hz or not self.iterations or not self.references:
            raise ValueError(
                "rates_hz, iterations and references need at least one value each: --rates-hz 500 1000"
            )
        for rate, count in itertools.product(self.rates_hz, self.iterations):
            try:
                self.at(rate, count)
            except ValidationError as error:
                first = error.errors()[0]
                what = f"rates_hz: {rate} Hz" if first["loc"] == ("rate_hz",) else f"iterations: {count}"
                raise ValueError(f"{what}: {first['msg'].lower()}") from None
        finest = (max(*self.rates_hz, self.physics.rate_hz), self._most_iterations)
        for reference in self.references:
            if reference.rate_hz <= finest[0] or reference.position_iterations <= finest[1]:
                raise ValueError(
                    f"references must be finer than all that is compared with them, {setting_name(*finest)}, "
                    f"in rate and iterations; got {reference.name}"
                )
        for group, labels in self.variants.items():
            for label, values in labels.items():
                self._check_variant(f"{group}: {label}", values)
        if "finger_damping" in self.ranges:
            raise ValueError("ranges: finger_damping is not drawn, it stays critical; draw finger_stiffness")
        for name, (low, high) in self.ranges.items():
            known = Physics.model_fields.get(name)
            if known is None or known.annotation is not float or not low <= high:
                raise ValueError(f"ranges: {name} must be a real-valued setting of physics, from low to high")
            for bound in (low, high):
                _physics(self.physics.model_dump() | {name: bound}, "ranges")
        return self

    @property
    def _most_iterations(self) -> int:
        return max(*self.iterations, self.physics.position_iterations)

    def _check_variant(self, name: str, values: dict[str, Value]) -> None:
        unknown = values.keys() - Physics.model_fields.keys() - {"density", "hulls", "rest"}
        if unknown:
            raise ValueError(f"variants: {name!r} sets {', '.join(sorted(unknown))}, no setting of physics")
        for key, legal in (("hulls", HULLS), ("rest", RESTS)):
            if key in values and values[key] not in legal:
                raise ValueError(f"variants: {name!r}: {key} must be one of {', '.join(legal)}")
        density = values.get("density", 1.0)
        if not isinstance(density, float) or density <= 0:
            raise ValueError(f"variants: {name!r}: density must be a factor above 0, got {density!r}")
        if self._can_lift(values):
            self._variant(name, values)

    def _can_lift(self, values: dict[str, Value]) -> bool:
        coarse = values.get("coarse_rate_hz")
        return "rate_hz" in values or not isinstance(coarse, float) or coarse <= self.physics.rate_hz

    def tried_variants(self) -> list[tuple[str, str, dict[str, Value]]]:
        """Group, label and values of the variants, without those that lift at more than production's rate."""
        return [
            (group, label, values)
            for group, labels in self.variants.items()
            for label, values in labels.items()
            if self._can_lift(values)
        ]

    def at(self, rate_hz: int, iterations: int) -> Physics:
        """The settings under test at another rate and other iterations."""
        coarse = min(rate_hz, self.physics.coarse_rate_hz)
        values = {"rate_hz": rate_hz, "coarse_rate_hz": coarse, "position_iterations": iterations}
        return Physics.model_validate(self.physics.model_dump() | values)

    @property
    def production(self) -> str:
        """Name of the setting under test in the grid."""
        return setting_name(self.physics.rate_hz, self.physics.position_iterations)

    def n_of(self, reference: Reference) -> int:
        """Grasps of each part that are compared with a reference."""
        return min(self.grasps_per_part, reference.grasps_per_part)

    @property
    def n_variants(self) -> int:
        """Grasps of each part that are tried under a variant."""
        return min(self.grasps_per_part, self.variant_grasps_per_part)

    def candidates(self) -> dict[str, tuple[int, int]]:
        """Rate and iterations of the grid's settings from which data may be collected, production's too."""
        rates = [rate for rate in self.rates_hz if rate >= LEAST_RATE_HZ]
        pairs = {(rate, count) for rate in rates for count in self.iterations}
        pairs.add((self.physics.rate_hz, self.physics.position_iterations))
        return {setting_name(*pair): pair for pair in sorted(pairs)}

    def settings(self) -> list[Setting]:
        """All that is simulated: production and its floor, references and floors, the grid, variants."""
        n = self.grasps_per_part
        whole = self.physics.model_copy(update={"skip_air": False})
        found = [
            Setting(name=NOMINAL, physics=self.physics, n=n),
            Setting(name=MOVED, physics=self.physics, n=self.n_variants, shift=SHIFT),
            Setting(name=NOTHING_SKIPPED, physics=whole, n=self.n_variants),
        ]
        for k, reference in enumerate(self.references):
            physics = self.at(reference.rate_hz, reference.position_iterations).model_copy(
                update={"skip_air": False, "coarse_rate_hz": reference.rate_hz}
            )
            name, n = reference.name, self.n_of(reference)
            again = min(n, reference.floor_grasps_per_part)
            found += [
                Setting(name=name, physics=physics, n=n),
                Setting(name=floor_name(name), physics=physics, n=again, shift=SHIFT),
            ]
            if k == 0:
                again = min(again, self.n_variants)
                found.append(Setting(name=rounding_name(name), physics=physics, n=again, shift=ROUNDING))
        pairs = {(rate, count) for rate in self.rates_hz for count in self.iterations}
        pairs -= {(self.physics.rate_hz, self.physics.position_iterations)}
        n = self.n_of(self.references[0])
        found += [Setting(name=setting_name(*pair), physics=self.at(*pair), n=n) for pair in sorted(pairs)]
        found += [
            self._variant(variant_name(group, label), own) for group, label, own in self.tried_variants()
        ]
        if self.ranges:
            found.append(Setting(name=DRAWN, physics=self.physics, n=self.n_variants, ranges=self.ranges))
        return found

    def _variant(self, name: str, values: dict[str, Value]) -> Setting:
        own: dict[str, Any] = {key: values[key] for key in ("density", "hulls", "rest") if key in values}
        physics = self.physics.model_dump() | {key: values[key] for key in values.keys() - own.keys()}
        return Setting(name=name, physics=_physics(physics, f"variants: {name!r}"), n=self.n_variants, **own)

    def engines(self) -> list[Setting]:
        """The settings under test in both engines, and in each with the starts moved by 0.1 mm."""
        engines: tuple[Engine, ...] = ("sapien", "mujoco")
        n = self.grasps_per_part
        return [
            *(Setting(name=name, physics=self.physics, n=n, engine=name) for name in engines),
            *(
                Setting(name=name + SHIFTED, physics=self.physics, n=n, shift=CELL_SHIFT, engine=name)
                for name in engines
            ),
        ]


SHIFTED = ", starts moved by 0.1 mm"


def _physics(values: dict[str, Any], source: str) -> Physics:
    try:
        return check_config(Physics, values, source)
    except BadConfig as error:
        raise ValueError(str(error)) from None


def drawn_physics(
    physics: Physics, ranges: dict[str, tuple[float, float]], rng: np.random.Generator
) -> Physics:
    """Settings with some values drawn uniformly."""
    values = physics.model_dump() | {name: float(rng.uniform(*bounds)) for name, bounds in ranges.items()}
    mass = values["finger_armature"] + FINGER_MASS
    values["finger_damping"] = 2 * math.sqrt(values["finger_stiffness"] * mass)
    return Physics.model_validate(values)


def setting_name(rate_hz: int, iterations: int) -> str:
    """Name of a rate and iterations in tables."""
    return f"{rate_hz} Hz, {iterations} it"


def floor_name(reference: str) -> str:
    """Name of a reference whose starts are moved by `SHIFT`."""
    return f"{reference}, starts moved by 10 um"


def rounding_name(reference: str) -> str:
    """Name of a reference whose starts are moved by `ROUNDING`."""
    return f"{reference}, starts moved by 0.1 um"


def variant_name(group: str, label: str) -> str:
    """Name of a variant among the settings."""
    return f"{group}: {label}"
