"""Networks, their training samples, training, metrics and stored models.

Names are imported when they are first used: settings can be read without torch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mskgrasp.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from mskgrasp.learning.config import LearningConfig, StageConfig
    from mskgrasp.learning.grasp_models import Models, load_models, save_model
    from mskgrasp.learning.held_out import measure_models
    from mskgrasp.learning.model_metrics import EpochMetrics, ModelMetrics
    from mskgrasp.learning.samples import Samples, read_samples
    from mskgrasp.learning.sides import Sides, split
    from mskgrasp.learning.stage import Reporter
    from mskgrasp.learning.trainer import train

__all__ = [
    "EpochMetrics", "LearningConfig", "ModelMetrics", "Models", "Reporter", "Samples", "Sides", "StageConfig",
    "load_models", "measure_models", "read_samples", "save_model", "split", "train",
]  # fmt: skip

_HOMES = {
    "mskgrasp.learning.config": ("LearningConfig", "StageConfig"),
    "mskgrasp.learning.grasp_models": ("Models", "load_models", "save_model"),
    "mskgrasp.learning.held_out": ("measure_models",),
    "mskgrasp.learning.model_metrics": ("EpochMetrics", "ModelMetrics"),
    "mskgrasp.learning.samples": ("Samples", "read_samples"),
    "mskgrasp.learning.sides": ("Sides", "split"),
    "mskgrasp.learning.stage": ("Reporter",),
    "mskgrasp.learning.trainer": ("train",),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
