"""Program: train the networks. Run ``python -m mskgrasp.train --help``, or call `run_training`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mskgrasp.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from mskgrasp.train.config import TrainConfig, default_config
    from mskgrasp.train.run import run_training

__all__ = ["TrainConfig", "default_config", "run_training"]

_HOMES = {
    "mskgrasp.train.config": ("TrainConfig", "default_config"),
    "mskgrasp.train.run": ("run_training",),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
