"""Keep-outs in a cell's file: spheres, capsules and boxes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from hal.keep_out import Box, Capsule, KeepOut
from mskgrasp.core.config import Config

Coordinate = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Radius = Annotated[float, Field(gt=0, le=2, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=40)]


class SphereConfig(Config):
    """A sphere."""

    shape: Literal["sphere"]
    name: Name = "sphere"
    """For messages, such as "lamp"."""
    centre: Point
    """Base frame, m."""
    radius: Radius
    """m."""

    def keep_out(self) -> KeepOut:
        """The shape."""
        return Capsule(name=self.name, ends=np.array([self.centre, self.centre]), radius=self.radius)


class CapsuleConfig(Config):
    """All points within a radius of a segment, such as a post or a cable."""

    shape: Literal["capsule"]
    name: Name = "capsule"
    """For messages, such as "post"."""
    ends: tuple[Point, Point]
    """Ends of the segment, base frame, m."""
    radius: Radius
    """m."""

    def keep_out(self) -> KeepOut:
        """The shape."""
        return Capsule(name=self.name, ends=np.array(self.ends), radius=self.radius)


class BoxConfig(Config):
    """A box along the base's axes, such as a shelf."""

    shape: Literal["box"]
    name: Name = "box"
    """For messages, such as "shelf"."""
    lower: Point
    """Corner, base frame, m."""
    upper: Point
    """The other corner, m."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not (np.array(self.lower) < np.array(self.upper)).all():
            raise ValueError(f"lower {list(self.lower)} must be below upper {list(self.upper)} in x, y and z")
        return self

    def keep_out(self) -> KeepOut:
        """The shape."""
        return Box(name=self.name, lower=np.array(self.lower), upper=np.array(self.upper))


KeepOutConfig = Annotated[SphereConfig | CapsuleConfig | BoxConfig, Field(discriminator="shape")]


def keep_outs(shapes: tuple[KeepOutConfig, ...]) -> tuple[KeepOut, ...]:
    """The shapes of a section."""
    return tuple(one.keep_out() for one in shapes)
