"""What decides the networks' shape, and the numbers that turn their units into metres and radians."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator, model_validator

from mskgrasp.core.config import Config


class NetworkConfig(Config):
    """Architecture; the defaults are the paper's (figure 3).

    The paper does not state the padding. Convolutions are "valid", the default of Keras at the time.
    """

    architecture: Literal["patch", "hand"] = "patch"
    """patch: the paper's, a picture of the heights; hand: a coarse one of what the hand would meet."""
    image: Literal["grasp", "object"] = "grasp"
    """What the displacement network sees: the patch around the grasp (the paper's GCIP), or one around the
    part, not turned, beside the grasp's angle (OCFI). The quality network always sees the grasp's."""
    patch_pixels: int = Field(default=64, ge=16, le=256)
    """Pixels along the closing direction."""
    patch_columns: int | None = Field(default=None, ge=8, le=256)
    """Pixels across it; null: as many."""
    patch_side: float = Field(default=0.128, gt=0.0, le=1.0)
    """Length along the closing direction, metres."""
    channels: int = Field(default=32, ge=1)
    trunk_width: int = Field(default=1024, ge=1)
    action_width: int = Field(default=64, ge=1)
    head_width: int = Field(default=512, ge=1)
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)
    variance: bool = True
    """False: the displacement network predicts the mean alone (the paper's GCIP-M)."""
    symmetric_views: bool = False
    """A grasp's displacement is the mean of what the network says of the four views that a parallel jaw
    cannot tell apart (`symmetry`), its variance that of their mixture: equal grasps are told the
    same."""
    quality_stride: int = Field(default=1, ge=1, le=8)
    """hand: the quality network sees every so many-th pixel: it has thousands of grasps to look at."""
    quality_columns: int | None = Field(default=None, ge=4, le=256)
    """hand: so many of these across the closing direction; null: all that the patch has."""
    layers: tuple[int, ...] = Field(default=(16, 32), min_length=1, max_length=6)
    """hand: channels of the quality network's convolutions, each of which halves the picture."""
    displacement_layers: tuple[int, ...] = Field(default=(16, 32, 32), min_length=1, max_length=6)
    """hand: the same of the displacement network."""
    least_std: tuple[float, float] = (0.0, 0.0)
    """Deviation, metres and radians, below which no displacement is claimed to be known (paper: none).

    Most parts do not rise in the hand by 0.1 mm, some rise by 10 mm: without a floor the likelihood drives
    the variance of z so low that one such part costs more than all others gain.
    """

    @model_validator(mode="after")
    def _check(self) -> NetworkConfig:
        if self.architecture == "patch" and self.patch_pixels < 32:
            raise ValueError("architecture: patch needs patch_pixels of 32 or more")
        if self.architecture == "patch" and self.patch_shape[0] != self.patch_shape[1]:
            raise ValueError("architecture: patch needs a square patch; leave patch_columns away")
        if self.image == "object" and self.architecture != "patch":
            raise ValueError("image: object needs architecture: patch")
        if self.image == "object" and self.symmetric_views:
            raise ValueError("symmetric_views turns patches with their grasp; image: object has none")
        if self.architecture == "patch" and self.quality_stride != 1:
            raise ValueError("architecture: patch shows all pixels to both networks; quality_stride is 1")
        if self.architecture == "patch" and self.quality_columns is not None:
            raise ValueError("architecture: patch shows both networks all; leave quality_columns away")
        if any((pixels - 1) % self.quality_stride for pixels in self.patch_shape):
            raise ValueError("the patch's middle must be a pixel that quality_stride leaves")
        spare = -(-self.patch_shape[1] // self.quality_stride) - self.quality_shape[1]
        if spare < 0 or spare % 2:
            raise ValueError("quality_columns must leave as many columns of the patch on either side")
        if not all(0 < width <= 512 for width in (*self.layers, *self.displacement_layers)):
            raise ValueError("layers: channels must be between 1 and 512")
        return self

    @property
    def patch_shape(self) -> tuple[int, int]:
        """Rows and columns of a patch; the fingers close along the columns."""
        return self.patch_pixels, self.patch_columns or self.patch_pixels

    @property
    def quality_shape(self) -> tuple[int, int]:
        """The same of what the quality network sees."""
        rows, columns = (-(-pixels // self.quality_stride) for pixels in self.patch_shape)
        return rows, self.quality_columns or columns

    @property
    def pixel(self) -> float:
        """Distance of a patch's pixels, metres."""
        return self.patch_side / self.patch_pixels

    @field_validator("least_std")
    @classmethod
    def _not_negative(cls, values: tuple[float, float]) -> tuple[float, float]:
        if not all(0 <= value < float("inf") for value in values):
            raise ValueError("deviations must not be negative")
        return values


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
