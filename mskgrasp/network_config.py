"""What decides the networks' shape, and the numbers that turn their units into metres and radians."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from mskgrasp.config import Config


class NetworkConfig(Config):
    """Architecture; the defaults are the paper's (figure 3).

    The paper does not state the padding. Convolutions are "valid", the default of Keras at the time.
    """

    architecture: Literal["patch", "field"] = "patch"
    """patch: the paper's, every grasp sees a picture of its own; field: grasps share features."""
    image: Literal["grasp", "object"] = "grasp"
    """What the displacement network sees: the patch around the grasp (the paper's GCIP), or one around the
    part, not turned, beside the grasp's angle (OCFI). The quality network always sees the grasp's."""
    patch_pixels: int = Field(default=64, ge=32, le=256)
    patch_side: float = Field(default=0.128, gt=0.0, le=1.0)
    channels: int = Field(default=32, ge=1)
    trunk_width: int = Field(default=1024, ge=1)
    action_width: int = Field(default=64, ge=1)
    head_width: int = Field(default=512, ge=1)
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)
    variance: bool = True
    """False: the displacement network predicts the mean alone (the paper's GCIP-M)."""
    blocks: int = Field(default=2, ge=0, le=8)
    """field: residual convolutions after the two that halve the picture."""
    grid: tuple[int, int] = (7, 9)
    """field: points across and along the closing direction at which a grasp reads the features."""
    grid_step: float = Field(default=0.012, gt=0.0, le=0.1)
    """field: distance of these points, metres."""
    least_std: tuple[float, float] = (0.0, 0.0)
    """Deviation, metres and radians, below which no displacement is claimed to be known (paper: none).

    Most parts do not rise in the hand by 0.1 mm, some rise by 10 mm: without a floor the likelihood drives
    the variance of z so low that one such part costs more than all others gain.
    """

    @model_validator(mode="after")
    def _check(self) -> NetworkConfig:
        if self.image == "object" and self.architecture != "patch":
            raise ValueError("image: object needs architecture: patch")
        return self

    @field_validator("least_std")
    @classmethod
    def _not_negative(cls, values: tuple[float, float]) -> tuple[float, float]:
        if not all(0 <= value < float("inf") for value in values):
            raise ValueError("deviations must not be negative")
        return values


def patch_plane(network: NetworkConfig, grasps: np.ndarray, centre_base: np.ndarray) -> np.ndarray:
    """Grasps (n, 4) moved to the height at which their patches are cropped.

    The paper's patches lie at the height of the grasp, as DESIGN says; those that share a map must lie at one
    height, half that of the part.
    """
    if network.architecture == "patch":
        return grasps
    moved = np.array(grasps, dtype=np.float64)
    moved[:, 2] = np.asarray(centre_base)[..., 2]
    return moved


class Normalisation(Config):
    """Numbers from the training data that turn network units into metres, radians and probabilities."""

    action_scale: tuple[float, float, float]
    """Largest distance of the object centre from the grasp along each axis, metres."""
    target_mean: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    target_std: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Of the grasp displacement, metres and radians."""
    base_rate: float = Field(default=0.5, gt=0.0, lt=1.0)
    """Share of successes among the attempts; training shows the network as many of either kind."""

    @field_validator("action_scale", "target_std")
    @classmethod
    def _positive(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0 < value < float("inf") for value in values):
            raise ValueError("scales must be positive and finite")
        return values
