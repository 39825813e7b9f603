"""Networks that are small enough to be built and trained in a test."""

import torch

from mskgrasp.learning.config import LearningConfig, StageConfig
from mskgrasp.learning.grasp_models import ModelMeta, Models, build_models
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation, PatchNetworkConfig

SMALL = PatchNetworkConfig(
    patch_pixels=32, channels=4, trunk_width=16, action_width=8, head_width=8, dropout=0.5
)
NORMAL = Normalisation(
    action_scale=(0.05, 0.02, 0.01),
    target_mean=(0.0, 0.0, 0.001, 0.0),
    target_std=(0.002, 0.005, 0.001, 0.2),
    base_rate=0.2,
)
PATCH = LearningConfig(
    validation_fraction=0.2,
    network=PatchNetworkConfig(
        patch_pixels=40, channels=8, trunk_width=64, action_width=32, head_width=64, dropout=0.0
    ),
    noise_std=0.001,
    gqn=StageConfig(learning_rate=2e-3, epochs=12, batch_size=16),
    gdn=StageConfig(learning_rate=2e-3, epochs=30, batch_size=16),
)
SHORT = PATCH.model_copy(
    update={
        "gqn": StageConfig(learning_rate=1e-3, epochs=2, batch_size=32),
        "gdn": StageConfig(learning_rate=1e-3, epochs=3, batch_size=32),
    }
)
HAND = PATCH.model_copy(
    update={
        "network": HandNetworkConfig(
            patch_pixels=33,
            patch_side=0.132,
            quality_stride=2,
            quality_columns=9,
            layers=(8, 8),
            displacement_layers=(8, 16),
            trunk_width=32,
            action_width=32,
            head_width=32,
            dropout=0.0,
        ),
        "gqn": StageConfig(learning_rate=4e-3, epochs=14, batch_size=32),
        "gdn": StageConfig(learning_rate=4e-3, epochs=10, batch_size=16),
    }
)


def small_models(seed: int = 0, **changes: object) -> Models:
    torch.manual_seed(seed)
    return build_models(ModelMeta(network=SMALL.model_copy(update=changes), normalisation=NORMAL))
