"""Settings of a training run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import tyro
from pydantic import Field

from mskgrasp.core.config import check_config, read_config
from mskgrasp.core.shipped import config_file
from mskgrasp.learning.config import DeviceName, LearningConfig
from mskgrasp.learning.network_config import NetworkConfig, PatchNetworkConfig

DEFAULT_CONFIG = config_file("train/default.yaml")


class TrainConfig(LearningConfig):
    """Settings of a training run."""

    # The file chooses the architecture; options set its fields.
    network: Annotated[NetworkConfig, tyro.conf.AvoidSubcommands] = PatchNetworkConfig()
    """Architecture of both networks."""
    data: Path | None = None
    """The dataset folder."""
    planned: tuple[Path, ...] = ()
    """Further datasets at the same parts, of grasps that a planner chose (collect's planned_by);
    success_range selects parts by ``data`` alone."""
    out: Path | None = None
    """The model's folder. A run that was interrupted resumes when it is started again in the same way."""
    epochs: int | None = Field(default=None, ge=1)
    """Epochs of each network, in place of those of gqn and gdn."""
    device: DeviceName = "auto"
    """auto: a CUDA device where there is one."""


def default_config(**changes: Any) -> TrainConfig:
    """Read the shipped settings, ``configs/train/default.yaml``, with some of them changed.

    Raises:
        BadConfig: A change names no setting, or has an illegal value.
    """
    settings = read_config(TrainConfig, DEFAULT_CONFIG).model_dump()
    return check_config(TrainConfig, settings | changes, "default_config")
