import pytest
import torch

from mskgrasp.learning.batch_norm import Normalised, add_batch_norms, fold_batch_norms
from mskgrasp.learning.config import StageConfig
from mskgrasp.learning.hand_features import HandFeatures, ResidualBlock
from mskgrasp.learning.network_config import HandNetworkConfig
from tests.learning.small import NORMAL

CONFIG = HandNetworkConfig(
    patch_pixels=16, patch_columns=8, displacement_layers=(4, 8), displacement_blocks=(1, 0)
)


def features():
    torch.manual_seed(0)
    layers, shape, blocks = CONFIG.displacement_layers, CONFIG.patch_shape, CONFIG.displacement_blocks
    return HandFeatures(CONFIG, NORMAL, layers, shape, blocks)


def inputs(n=32):
    generator = torch.Generator().manual_seed(1)
    patches = 0.05 * torch.rand(n, 1, 16, 8, generator=generator)
    return patches, torch.zeros(n, 3), torch.full((n,), 0.02)


def output(network):
    patches, centre, height = inputs()
    return network(network.prepare(patches, height), centre, height)


def learn(network, n_steps=20):
    """Some steps towards arbitrary features, after which no normalisation is as it was."""
    network.train()
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-2)
    target = torch.randn(32, network.n_features, generator=torch.Generator().manual_seed(2))
    for _ in range(n_steps):
        optimiser.zero_grad()
        (output(network) - target).square().mean().backward()
        optimiser.step()
    network.eval()


def test_a_trained_network_has_plain_layers_again_and_predicts_the_same():
    network, plain = features(), features()
    add_batch_norms(network)
    learn(network)
    assert sum(isinstance(one, Normalised) for one in network.modules()) == 5
    scales = [value for name, value in network.named_buffers() if name.endswith("running_var")]
    assert all(float((scale - 1).abs().max()) > 0.1 for scale in scales)
    with torch.no_grad():
        before = output(network)
        fold_batch_norms(network)
        after = output(network)
        untrained = output(plain)
    assert float((before - untrained).abs().max()) > 0.1
    assert torch.allclose(before, after, rtol=1e-4, atol=1e-5)
    assert [name for name, _ in network.named_parameters()] == [name for name, _ in plain.named_parameters()]
    # Plain layers load what was folded.
    plain.load_state_dict(network.state_dict())
    with torch.no_grad():
        assert torch.equal(output(plain), after)


def test_a_normalised_block_changes_nothing_at_first_and_has_gradients_of_ordinary_size():
    network = features()
    add_batch_norms(network)
    block = next(one for one in network.convolutions if isinstance(one, ResidualBlock))
    image = torch.rand(32, 4, 8, 4, generator=torch.Generator().manual_seed(3))
    changed = block(image)
    assert torch.equal(changed, image)
    changed.square().mean().backward()
    sizes = [float(one.grad.abs().max()) for one in block.parameters() if one.grad is not None]
    assert 0 < max(sizes) < 10


def test_a_batch_of_one_sample_is_impossible():
    with pytest.raises(ValueError, match="batch_norm: true needs batch_size: 4 or more"):
        StageConfig(batch_norm=True, batch_size=3)
