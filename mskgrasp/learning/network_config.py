"""Configuration of the two network architectures, and the normalisation of their inputs and targets."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from mskgrasp.core.config import Config

_Channels = Annotated[int, Field(ge=1, le=512)]
_Convolutions = Annotated[tuple[_Channels, ...], Field(min_length=1, max_length=6)]
_Blocks = tuple[Annotated[int, Field(ge=0, le=8)], ...]


class _NetworkConfig(Config):
    """Settings that both architectures have; the defaults are the paper's (figure 3)."""

    patch_side: float = Field(default=0.128, gt=0.0, le=1.0)
    """Length along the closing direction, metres."""
    trunk_width: int = Field(default=1024, ge=1, le=8192)
    """Features of the image after its layers."""
    action_width: int = Field(default=64, ge=1, le=8192)
    """Features of the part's centre relative to the grasp."""
    head_width: int = Field(default=512, ge=1, le=8192)
    """Features in the layer before the outputs."""
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)
    """Share of the features that training leaves out at random."""
    variance: bool = True
    """False: the displacement network predicts the mean alone (the paper's GCIP-M)."""
    symmetric_views: bool = False
    """The displacement is the mean of the predictions for the four views that a parallel jaw cannot tell
    apart (`symmetry`), its variance that of their mixture: equivalent grasps get the same prediction."""
    swing: bool = False
    """The displacement network predicts the swing of the part in the hand, too (paper: no)."""
    mixture: int = Field(default=1, ge=1, le=8)
    """Gaussians whose mixture the displacement network fits (paper: 1); it predicts their mean and variance.

    A peg stays in the hand or turns: one Gaussian fits neither.
    """
    least_std: tuple[float, float] = (0.0, 0.0)
    """Least standard deviation that is predicted, metres and radians (paper: none).

    Most parts do not rise in the hand by 0.1 mm, some rise by 10 mm: without a floor the likelihood drives
    the variance of z so low that one such part costs more than all others gain.
    """

    @property
    def n_outputs(self) -> int:
        """Number of predicted components: x, y, z, theta, and the swing about x and y."""
        return 6 if self.swing else 4

    @model_validator(mode="after")
    def _mixtures_have_variances(self) -> Self:
        if self.mixture > 1 and not self.variance:
            raise ValueError(
                f"mixture: {self.mixture} needs variance: true; without variances use mixture: 1"
            )
        return self

    @field_validator("least_std")
    @classmethod
    def _not_negative(cls, values: tuple[float, float]) -> tuple[float, float]:
        if not all(0 <= value < float("inf") for value in values):
            raise ValueError("deviations must be finite and not negative")
        return values


class PatchNetworkConfig(_NetworkConfig):
    """The paper's architecture: a square height image that both networks see.

    The paper does not state the padding. Convolutions are "valid", the default of Keras at the time.
    """

    architecture: Literal["patch"] = "patch"
    """The paper's."""
    image: Literal["grasp", "object"] = "grasp"
    """Input of the displacement network: the patch around the grasp (the paper's GCIP), or one around the
    part, not rotated, with the grasp's angle (OCFI). The quality network always sees the grasp's."""
    patch_pixels: int = Field(default=64, ge=32, le=256)
    """Pixels along either side."""
    channels: int = Field(default=32, ge=1, le=512)
    """Channels of each of the four convolutions."""
    quality_stride: ClassVar[int] = 1

    @model_validator(mode="after")
    def _views_need_rotated_patches(self) -> PatchNetworkConfig:
        used = {"symmetric_views": self.symmetric_views, "swing": self.swing, "mixture": self.mixture > 1}
        for name in used:
            if self.image == "object" and used[name]:
                raise ValueError(
                    f"{name} needs patches that are rotated with the grasp; with image: object none are"
                )
        return self

    @property
    def sees_object(self) -> bool:
        """Whether the displacement network sees the part's patch, not rotated, and the grasp's angle."""
        return self.image == "object"

    @property
    def patch_shape(self) -> tuple[int, int]:
        """Rows and columns of a patch."""
        return self.patch_pixels, self.patch_pixels

    @property
    def quality_shape(self) -> tuple[int, int]:
        """Rows and columns of the quality network's input."""
        return self.patch_shape

    @property
    def pixel(self) -> float:
        """Distance of a patch's pixels, metres."""
        return self.patch_side / self.patch_pixels


class HandNetworkConfig(_NetworkConfig):
    """Architecture that compares the heights around a grasp with those of the hand's parts."""

    architecture: Literal["hand"] = "hand"
    """Ours."""
    sees_object: ClassVar[bool] = False
    patch_pixels: int = Field(default=64, ge=16, le=256)
    """Pixels along the closing direction."""
    patch_columns: int | None = Field(default=None, ge=8, le=256)
    """Pixels across it; null: as many."""
    quality_stride: int = Field(default=1, ge=1, le=8)
    """The quality network sees every n-th pixel, since it has thousands of grasps to score."""
    quality_columns: int | None = Field(default=None, ge=4, le=256)
    """Number of its pixels across the closing direction; null: all that the patch has."""
    layers: _Convolutions = (16, 32)
    """Channels of the quality network's convolutions, each of which halves the image."""
    blocks: _Blocks = ()
    """Residual blocks after each of them (He et al. 2016); empty: none."""
    displacement_layers: _Convolutions = (16, 32, 32)
    """Channels of the displacement network's convolutions."""
    displacement_blocks: _Blocks = ()
    """Residual blocks after each of them; empty: none."""

    @model_validator(mode="after")
    def _blocks_follow_layers(self) -> HandNetworkConfig:
        for before in ("", "displacement_"):
            n_blocks, n_layers = (len(getattr(self, f"{before}{name}")) for name in ("blocks", "layers"))
            if n_blocks not in (0, n_layers):
                raise ValueError(
                    f"{before}blocks has {n_blocks} numbers, {before}layers has {n_layers}; give one for "
                    "each, or none"
                )
        return self

    @model_validator(mode="after")
    def _quality_pixels_are_centred(self) -> HandNetworkConfig:
        if any((pixels - 1) % self.quality_stride for pixels in self.patch_shape):
            raise ValueError(
                f"quality_stride {self.quality_stride} must divide patch_pixels - 1 and patch_columns - 1, "
                "so that the patch's middle is one of the pixels that are kept"
            )
        spare = -(-self.patch_shape[1] // self.quality_stride) - self.quality_shape[1]
        if spare < 0 or spare % 2:
            raise ValueError(
                "quality_columns must leave the same number of the patch's columns on either side"
            )
        return self

    @property
    def patch_shape(self) -> tuple[int, int]:
        """Rows and columns of a patch; the fingers close along the columns."""
        return self.patch_pixels, self.patch_columns or self.patch_pixels

    @property
    def quality_shape(self) -> tuple[int, int]:
        """Rows and columns of the quality network's input."""
        rows, columns = (-(-pixels // self.quality_stride) for pixels in self.patch_shape)
        return rows, self.quality_columns or columns

    @property
    def pixel(self) -> float:
        """Distance of a patch's pixels, metres."""
        return self.patch_side / self.patch_pixels


NetworkConfig = Annotated[PatchNetworkConfig | HandNetworkConfig, Field(discriminator="architecture")]
"""Either architecture; in a file, ``architecture`` says which."""


_Targets = Annotated[tuple[float, ...], Field(min_length=4, max_length=6)]


class Normalisation(Config):
    """Numbers from the training data that turn network units into metres, radians and probabilities."""

    action_scale: tuple[float, float, float]
    """Largest distance of the object centre from the grasp along each axis, metres."""
    target_mean: _Targets = (0.0, 0.0, 0.0, 0.0)
    target_std: _Targets = (1.0, 1.0, 1.0, 1.0)
    """Mean and standard deviation of the grasp displacement and, where it is predicted, of the swing; metres
    and radians."""
    base_rate: float = Field(default=0.5, gt=0.0, lt=1.0)
    """Share of successes among the attempts; training balances successes and failures."""

    @field_validator("action_scale", "target_std")
    @classmethod
    def _positive(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0 < value < float("inf") for value in values):
            raise ValueError("scales must be positive and finite")
        return values
