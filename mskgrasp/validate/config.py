"""Configuration of a validation: settings under test, parts, and finer settings for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.settings import Physics

Engine = Literal["sapien", "mujoco"]

SHIFT = 1e-5
"""By how much the starts of the floor are moved, m: less than any camera or arm could resolve."""
CELL_SHIFT = 1e-4
"""The same for the cell's floor: what a Panda repeats (ISO 9283, by its data sheet), m."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One way to simulate.

    Attributes:
        name: For tables and files.
        physics: Its values.
        shift: By how much the parts' starts are moved on the table, m: 0 but for the floors.
        engine: Simulator of the attempts.
    """

    name: str
    physics: Physics
    shift: float = 0.0
    engine: Engine = "sapien"


class ValidateConfig(Config):
    """Settings of a validation."""

    out: Path = Path("out/validate")
    """Folder of the report and of the outcomes, from which a stopped run resumes."""
    parts: tuple[str, ...] = ()
    """Names or folders of parts, or sets: starter, catalogue, train, validation, test; empty: starter."""
    grasps_per_part: int = Field(default=40, ge=1)
    """Grasps of each part that are tried under every setting."""
    seed: int = Field(default=0, ge=0)
    """The starts and grasps follow from it."""
    workers: Annotated[int, tyro.conf.arg(help="Processes; 0: one for each core.")] = Field(default=0, ge=0)
    """Processes; 0: one for each core."""
    rates_hz: tuple[int, ...] = (125, 250, 500, 1000)
    """Simulation rates; the finest setting has the highest of them, that under test included, throughout."""
    iterations: tuple[int, ...] = (8, 15, 25, 50)
    """Solver iterations; the most, those under test included, belong to the finest setting."""
    variants: Annotated[dict[str, dict[str, float | bool]], tyro.conf.Suppress] = {}
    """Other values of some physics settings, by a name for the tables: each is tried at the rate and with the
    iterations under test, and compared with the same finest setting. It shows the effect of these values."""
    engine: Engine = "sapien"
    """mujoco: compare the settings under test with a second engine, and nothing else; needs ``[mujoco]``."""
    convergence: bool = True
    """Whether grasps are compared under all rates and iterations; without, the checks take a minute."""
    physics: Physics = Physics()
    """The settings under test; rate and iterations mark the production setting in the grid."""

    @model_validator(mode="after")
    def _check(self) -> ValidateConfig:
        if not self.rates_hz or not self.iterations:
            raise ValueError("rates_hz and iterations need at least one value each")
        for rate in self.rates_hz:
            self.at(rate, self.iterations[0])
        for name, values in self.variants.items():
            unknown = values.keys() - Physics.model_fields.keys()
            if unknown:
                raise ValueError(
                    f"variants: {name!r} sets {', '.join(sorted(unknown))}, no setting of physics"
                )
            self.varied(name)
        return self

    def at(self, rate_hz: int, iterations: int) -> Physics:
        """The settings under test at another rate and other iterations."""
        coarse = min(rate_hz, self.physics.coarse_rate_hz)
        values = {"rate_hz": rate_hz, "coarse_rate_hz": coarse, "position_iterations": iterations}
        return Physics.model_validate(self.physics.model_dump() | values)

    def varied(self, name: str) -> Physics:
        """The settings under test with a variant's values."""
        return Physics.model_validate(self.physics.model_dump() | self.variants[name])

    @property
    def production(self) -> str:
        """Name of the setting under test."""
        return setting_name(self.physics.rate_hz, self.physics.position_iterations)

    def settings(self) -> list[Setting]:
        """The grid with the setting under test; reference and floor; the former in full; the variants."""
        pairs = {(rate, count) for rate in self.rates_hz for count in self.iterations}
        pairs.add((self.physics.rate_hz, self.physics.position_iterations))
        grid = [
            Setting(name=setting_name(rate, count), physics=self.at(rate, count))
            for rate, count in sorted(pairs)
        ]
        whole = {"skip_air": False}
        # The setting under test is never compared with a coarser one.
        finest_hz = max(*self.rates_hz, self.physics.rate_hz)
        finest = self.at(finest_hz, max(*self.iterations, self.physics.position_iterations)).model_copy(
            update=whole | {"coarse_rate_hz": finest_hz}
        )
        return [
            *grid,
            Setting(name=REFERENCE, physics=finest),
            Setting(name=FLOOR, physics=finest, shift=SHIFT),
            Setting(name=CELL_FLOOR, physics=finest, shift=CELL_SHIFT),
            Setting(name=NOTHING_SKIPPED, physics=self.physics.model_copy(update=whole)),
            *(Setting(name=name, physics=self.varied(name)) for name in self.variants),
        ]

    def engines(self) -> list[Setting]:
        """The settings under test in both engines, and in each with the starts moved by 0.1 mm."""
        engines: tuple[Engine, ...] = ("sapien", "mujoco")
        return [
            *(Setting(name=name, physics=self.physics, engine=name) for name in engines),
            *(
                Setting(name=f"{name}{MOVED}", physics=self.physics, shift=CELL_SHIFT, engine=name)
                for name in engines
            ),
        ]


MOVED = ", starts moved by 0.1 mm"
REFERENCE = "the finest, nothing skipped"
FLOOR = "the same, starts moved by 10 um"
CELL_FLOOR = "the same, starts moved by 0.1 mm"
NOTHING_SKIPPED = "under test, nothing skipped"


def setting_name(rate_hz: int, iterations: int) -> str:
    """Name of a setting in tables."""
    return f"{rate_hz} Hz, {iterations} it"
