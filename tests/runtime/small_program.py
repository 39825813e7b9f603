"""Configuration and commands of a program that is small enough to think about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.runtime.options import parse


class CameraConfig(Config):
    """Of the camera."""

    n_pixels: int = Field(default=64, ge=16)
    """Along an edge."""


class ProgramConfig(Config):
    """Settings."""

    camera: CameraConfig = CameraConfig()
    """The camera."""
    parts: tuple[str, ...] = ()
    """Names."""
    low: float = 0.0
    """Lower bound,
    included."""
    high: float = 1.0
    """Upper bound."""
    kind: Literal["apple", "pear"] = "apple"
    """Kind of fruit."""

    @model_validator(mode="after")
    def _in_order(self) -> ProgramConfig:
        if self.low > self.high:
            raise ValueError(f"low {self.low} is above high {self.high}; Swap them")
        return self


def parse_program(*arguments: str, default: Path | None = None) -> ProgramConfig:
    return parse(ProgramConfig, prog="program", description="Does.", default_config=default, argv=arguments)


@dataclass(frozen=True)
class Eat:
    """Eat fruit."""

    fruit: tyro.conf.Positional[str]
    """Which."""
    n_pieces: int = 1
    """How many."""


@dataclass(frozen=True)
class Drink:
    """Drink."""


@dataclass(frozen=True)
class Pay:
    """Pay."""

    amount: float
    """How much."""


COMMANDS = {"eat": Eat, "drink": Drink, "pay": Pay}
