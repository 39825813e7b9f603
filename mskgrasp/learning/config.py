"""Settings of training."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.learning.network_config import NetworkConfig, PatchNetworkConfig

DeviceName = Literal["auto", "cpu", "cuda"]
"""Device of networks; auto: a CUDA device where there is one."""


class StageConfig(Config):
    """Optimisation of one network."""

    optimiser: Literal["adam", "rmsprop"] = "adam"
    """Rule of the steps (paper: rmsprop)."""
    learning_rate: float = Field(default=1e-3, gt=0.0)
    """Greatest rate of the steps (paper: 1e-5)."""
    weight_decay: float = Field(default=0.0, ge=0.0)
    """With adam: each step takes learning_rate * weight_decay of a layer's weights away, not of its biases
    (AdamW: Loshchilov and Hutter 2019, arXiv 1711.05101)."""
    decay: float = Field(default=0.0, ge=0.0)
    """Keras's decay: step k uses learning_rate / (1 + decay * k)."""
    schedule: Literal["constant", "cosine"] = "cosine"
    """cosine: the rate falls to zero at the end, after a linear rise over the first 5 % of the steps."""
    epochs: int = Field(default=15, ge=1)
    """Greatest number of passes over the training data (paper: 100)."""
    patience: int | None = Field(default=None, ge=1)
    """Training ends after this many epochs without a lower validation loss; null: after all epochs."""
    batch_size: int = Field(default=32, ge=1)
    """Samples of a step."""
    batch_norm: bool = False
    """The image branch trains with batch normalisation, which is folded into its weights at the end: the
    model has the same layers, and takes the same time (paper: no)."""

    @model_validator(mode="after")
    def _settings_fit_together(self) -> StageConfig:
        if self.weight_decay > 0 and self.optimiser != "adam":
            raise ValueError(f"weight_decay: {self.weight_decay:g} needs optimiser: adam")
        if self.batch_norm and self.batch_size < 4:
            raise ValueError(
                "batch_norm: true needs batch_size: 4 or more, so that no batch is of one sample"
            )
        return self


class LearningConfig(Config):
    """Settings of training; with the same data, device type and threads they give the same model."""

    seed: int = Field(default=0, ge=0, lt=2**63)
    """Determines first weights, order of the samples, noise and dropout."""
    sides: Literal["name", "catalogue"] = "name"
    """Split of the parts: by a hash of their name, or as the catalogue says (validation and test are whole
    families, `new_sizes` other sizes of families that are trained on)."""
    validation_fraction: float = Field(default=0.2, gt=0.0, lt=1.0)
    """Share of the parts that training never sees, where they are split by name."""
    calibrate: bool = True
    """Correct quality and variances on the validation parts, at the end."""
    success_range: tuple[float, float] = (0.0, 1.0)
    """Parts whose success rate of random grasps lies outside are excluded (paper: 0.05 to 0.40)."""
    network: NetworkConfig = PatchNetworkConfig()
    """Architecture of both networks."""
    noise_std: float = Field(default=0.003, ge=0.0)
    """Noise on each pixel of a training patch, metres."""
    symmetric: bool = True
    """Half of the samples are rotated by half a turn, half are mirrored: the physics is symmetric."""
    mixed_precision: bool = False
    """The image branch trains in bfloat16, the rest in float32: faster on a GPU, or on a CPU with
    instructions for it (AMX)."""
    beta: float = Field(default=0.0, ge=0.0, le=1.0)
    """0: the paper's likelihood; 0.5: beta-NLL."""
    keep_best: bool = True
    """Keep the epoch of lowest validation loss instead of the last."""
    gqn: StageConfig = StageConfig()
    """Training of the quality network."""
    gdn: StageConfig = StageConfig()
    """Training of the displacement network."""

    @model_validator(mode="after")
    def _check(self) -> LearningConfig:
        low, high = self.success_range
        if not 0 <= low <= high <= 1:
            raise ValueError(f"success_range: {low:g} to {high:g} must be shares from low to high, 0 to 1")
        if self.symmetric and self.network.sees_object:
            raise ValueError(
                "symmetric: true needs patches that are rotated with the grasp; with image: object none are"
            )
        if self.network.mixture > 1 and self.beta > 0:
            raise ValueError(
                f"beta: {self.beta:g} needs network.mixture: 1; a mixture has the plain likelihood"
            )
        if self.network.symmetric_views and not self.symmetric:
            raise ValueError("network.symmetric_views needs symmetric: true, which trains on these views")
        return self
