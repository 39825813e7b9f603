import pytest
import torch

from mskgrasp.learning.grasp_models import ModelMeta, build_models
from mskgrasp.learning.hand_features import HandFeatures
from mskgrasp.learning.network_config import HandNetworkConfig
from tests.learning.small import NORMAL


def test_our_network_sees_what_the_hand_would_meet():
    config = HandNetworkConfig(patch_pixels=16, patch_columns=8, layers=(4, 8))
    features = HandFeatures(config, NORMAL, config.layers, config.quality_shape)
    # A step from the table to 30 mm, a finger tip at 10.5 mm (TCP at 20 mm), the palm far above.
    patch = torch.zeros(1, 1, 16, 8)
    patch[..., :8, :] = 0.03
    tips, beside, palm, table = features.prepare(patch, torch.tensor([0.02]))[0]
    assert torch.equal(tips[:8], torch.ones(8, 8)) and torch.equal(tips[8:], -torch.ones(8, 8))
    assert torch.allclose(beside[:8], torch.tensor(1 / 3)) and torch.allclose(
        beside[8:], torch.tensor(-2 / 3)
    )
    assert torch.equal(palm, -torch.ones(16, 8)) and torch.allclose(table[:8], torch.tensor(0.6))
    # 56 mm below the top of a part the palm meets it.
    assert float(features.prepare(patch + 0.05, torch.tensor([0.02]))[0, 2, 0, 0]) == 1.0
    models = build_models(ModelMeta(network=config, normalisation=NORMAL))
    inputs = torch.rand(3, 1, 16, 8), torch.zeros(3, 3), torch.full((3,), 0.02)
    assert models.quality(*inputs).shape == (3,) and models.grasp_displacement(*inputs)[0].shape == (3, 4)


def test_residual_blocks_change_nothing_until_they_have_learned():
    plain = HandNetworkConfig(patch_pixels=16, patch_columns=8, displacement_layers=(4, 8))
    deep = plain.model_copy(update={"displacement_blocks": (2, 0)})
    torch.manual_seed(0)
    shallow = build_models(ModelMeta(network=plain, normalisation=NORMAL)).gdn
    blocks = build_models(ModelMeta(network=deep, normalisation=NORMAL)).gdn
    own = {
        name: value for name, value in blocks.named_parameters() if ".first." in name or ".second." in name
    }
    assert len(own) == 2 * 4
    rest = [value for name, value in blocks.named_parameters() if name not in own]
    with torch.no_grad():
        for value, other in zip(rest, shallow.parameters(), strict=True):
            value.copy_(other)
    inputs = torch.rand(3, 1, 16, 8) * 0.05, torch.rand(3, 3) * 0.01, torch.full((3,), 0.02)
    assert torch.equal(blocks(*inputs)[0], shallow(*inputs)[0])


def test_blocks_are_given_for_every_convolution_or_none():
    with pytest.raises(ValueError, match="displacement_blocks has 1 numbers, displacement_layers has 2"):
        HandNetworkConfig(displacement_layers=(4, 8), displacement_blocks=(1,))
    with pytest.raises(ValueError, match="blocks has 1 numbers, layers has 2"):
        HandNetworkConfig(layers=(4, 8), blocks=(1,))
