"""Two squares of white tape on top of a part, from which a camera measures its motion."""

from __future__ import annotations

from pydantic import Field, model_validator

from mskgrasp.core.config import Config

LEAST_RATIO = 1.25
"""Least ratio of the sides; squares closer in size may be confused."""


class Tape(Config):
    """Sizes of the squares, as measured on the part; the squares are distinguished by size."""

    large: float = Field(default=0.012, ge=0.006, le=0.04)
    """Side of the larger square, m."""
    small: float = Field(default=0.008, ge=0.004, le=0.03)
    """Side of the smaller square, m."""

    @model_validator(mode="after")
    def _check(self) -> Tape:
        if self.large < LEAST_RATIO * self.small:
            raise ValueError(
                f"large {self.large:g} m must be at least {LEAST_RATIO:g} times small ({self.small:g} m), or "
                "the squares are taken for each other"
            )
        return self

    @property
    def sides(self) -> tuple[float, float]:
        """Sides of the larger and the smaller square, metres."""
        return self.large, self.small
