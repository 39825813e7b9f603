import numpy as np
import pytest
import torch

from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.learning.networks import (
    Gaussians,
    GraspDisplacementNetwork,
    GraspQualityNetwork,
    displacement_loss,
    mixture_loss,
    standardise,
    with_noise,
)
from tests.learning.small import NORMAL, small_models


def count(network):
    return sum(parameter.numel() for parameter in network.parameters())


def test_the_papers_networks_have_the_sizes_worked_out_by_hand():
    # Valid padding: 64 -> 60 -> 56 -> pool 28 -> 24 -> 20 -> pool 10, and 10 * 10 * 32 = 3200.
    convolutions = (25 * 1 * 32 + 32) + 3 * (25 * 32 * 32 + 32)
    trunk, action = 3200 * 1024 + 1024, 3 * 64 + 64
    hidden = (1024 + 64) * 512 + 512
    shared = convolutions + trunk + action
    assert (
        count(GraspQualityNetwork(PatchNetworkConfig(), NORMAL)) == shared + hidden + 512 * 2 + 2 == 3914402
    )
    gdn = GraspDisplacementNetwork(PatchNetworkConfig(), NORMAL)
    assert count(gdn) == shared + 2 * (hidden + 512 * 4 + 4) == 4475048
    mean_only = GraspDisplacementNetwork(PatchNetworkConfig(variance=False), NORMAL)
    assert count(mean_only) == shared + hidden + 512 * 4 + 4


def test_outputs_have_their_shapes_and_variances_are_positive():
    models = small_models()
    patches, centres, height = torch.rand(5, 1, 32, 32), torch.rand(5, 3) * 0.02, torch.rand(5) * 0.03
    quality = models.quality(patches, centres, height)
    mean, variance = models.grasp_displacement(patches, centres, height)
    assert quality.shape == (5,) and mean.shape == variance.shape == (5, 4)
    assert bool(((quality > 0) & (quality < 1)).all()) and bool((variance > 0).all())
    assert small_models(variance=False).grasp_displacement(patches, centres, height)[1] is None


def test_an_undecided_network_says_the_base_rate():
    models = small_models()
    assert float(models.gqn.quality(torch.zeros(1, 2))) == pytest.approx(0.2)


def test_an_untrained_network_predicts_in_the_units_of_its_targets():
    models = small_models()
    with torch.no_grad():
        models.gdn.mean_head[-1].weight.zero_()
        models.gdn.mean_head[-1].bias.zero_()
        models.gdn.variance_head[-1].weight.zero_()
        models.gdn.variance_head[-1].bias.zero_()
    mean, variance = models.grasp_displacement(torch.rand(2, 1, 32, 32), torch.zeros(2, 3), torch.zeros(2))
    assert torch.allclose(mean, torch.tensor(NORMAL.target_mean))
    assert torch.allclose(variance, torch.tensor(NORMAL.target_std).square())


def test_no_displacement_is_claimed_to_be_known_below_the_floor():
    models = small_models(least_std=(0.0005, 0.01))
    with torch.no_grad():
        models.gdn.variance_head[-1].bias.fill_(-100.0)
    _, variance = models.grasp_displacement(torch.rand(2, 1, 32, 32), torch.zeros(2, 3), torch.zeros(2))
    floor = torch.tensor([0.0005, 0.0005, 0.0005, 0.01])
    assert bool((variance.sqrt() >= floor * 0.999).all()) and torch.allclose(
        variance.sqrt(), floor, rtol=0.01
    )


def test_preprocessing_standardises_and_ignores_the_height():
    patches = torch.rand(3, 1, 32, 32) * 0.05
    done = standardise(patches)
    assert torch.allclose(done.mean(dim=(1, 2, 3)), torch.zeros(3), atol=1e-4)
    assert torch.allclose(done.std(dim=(1, 2, 3)), torch.ones(3), atol=0.02)
    assert torch.allclose(standardise(patches + 0.3), done, atol=1e-3)
    flat = standardise(torch.full((1, 1, 32, 32), 0.01))
    assert float(flat.abs().max()) < 1e-4


def test_noise_has_its_deviation_and_comes_from_the_generator_alone():
    patches = torch.zeros(4, 1, 64, 64)
    first, again = (with_noise(patches, 0.003, torch.Generator().manual_seed(1)) for _ in "ab")
    assert torch.equal(first, again)
    assert float(first.std()) == pytest.approx(0.003, rel=0.02)
    # Standardised, it is divided by its own deviation and the epsilon of 0.1 mm.
    assert float(standardise(first).std()) == pytest.approx(0.003 / 0.0031, rel=0.02)


def test_the_gdn_starts_from_the_gqns_convolutions_only():
    models = small_models()
    models.gdn.start_from(models.gqn)
    for one, other in zip(
        models.gqn.features.convolutions.parameters(),
        models.gdn.features.convolutions.parameters(),
        strict=True,
    ):
        assert torch.equal(one, other) and one is not other
    assert not torch.equal(models.gqn.features.image[1].weight, models.gdn.features.image[1].weight)


def test_the_loss_is_twice_the_gaussian_likelihood_up_to_a_constant():
    torch.manual_seed(0)
    std = torch.tensor(NORMAL.target_std)
    mean, target = torch.randn(2, 6, 4) * std
    variance = (torch.rand(6, 4) + 0.5) * std.square()
    likelihood = torch.distributions.Normal(mean, variance.sqrt()).log_prob(target).sum(dim=-1).mean()
    constant = 4 * np.log(2 * np.pi) + 2 * float(std.log().sum())
    loss = displacement_loss(mean, variance, target, std)
    assert float(loss) == pytest.approx(-2 * float(likelihood) - constant, rel=1e-5)


def test_the_loss_wraps_the_angle_and_is_four_for_the_trivial_prediction():
    std = torch.ones(4)
    mean, target = torch.zeros(1, 4), torch.zeros(1, 4)
    mean[0, 3], target[0, 3] = 3.1, -3.1
    assert float(displacement_loss(mean, None, target, std)) == pytest.approx(
        (2 * np.pi - 6.2) ** 2, rel=1e-4
    )
    many = torch.randn(50000, 4, generator=torch.Generator().manual_seed(0)) * 0.3
    trivial = displacement_loss(torch.zeros_like(many), torch.full_like(many, 0.09), many, std * 0.3)
    assert float(trivial) == pytest.approx(4.0, rel=0.02)


def test_the_loss_is_least_at_the_true_mean_and_variance():
    target = torch.randn(20000, 4, generator=torch.Generator().manual_seed(0)) * 0.5 + 0.1
    std = torch.ones(4)

    def loss(mean, variance):
        return float(
            displacement_loss(torch.full_like(target, mean), torch.full_like(target, variance), target, std)
        )

    best = loss(0.1, 0.25)
    assert all(best < loss(*other) for other in ((0.2, 0.25), (0.0, 0.25), (0.1, 0.35), (0.1, 0.18)))


def test_a_mixtures_loss_is_twice_its_likelihood_up_to_a_constant():
    torch.manual_seed(0)
    std = torch.tensor(NORMAL.target_std)
    mean, target = torch.randn(6, 3, 4) * std, torch.randn(6, 4) * std
    variance = (torch.rand(6, 3, 4) + 0.5) * std.square()
    weight = torch.softmax(torch.randn(6, 3), dim=-1)
    each = torch.distributions.Independent(torch.distributions.Normal(mean, variance.sqrt()), 1)
    mixture = torch.distributions.MixtureSameFamily(torch.distributions.Categorical(weight), each)
    constant = 4 * np.log(2 * np.pi) + 2 * float(std.log().sum())
    loss = mixture_loss(Gaussians(mean, variance, weight.log()), target, std)
    assert float(loss) == pytest.approx(-2 * float(mixture.log_prob(target).mean()) - constant, rel=1e-5)


def test_a_mixture_predicts_the_mean_and_variance_of_draws_from_it():
    torch.manual_seed(0)
    gdn = small_models(mixture=3).gdn
    features = torch.randn(2, gdn.features.n_features)
    with torch.no_grad():
        mean, variance = gdn.outputs(features)
        found = gdn.gaussians(features)
    which = torch.distributions.Categorical(found.log_weight.exp()).sample((200_000,))
    rows = torch.arange(2).expand_as(which)
    draws = torch.normal(found.mean[rows, which], found.variance[rows, which].sqrt())
    std = torch.tensor(NORMAL.target_std)
    assert torch.allclose(draws.mean(dim=0) / std, mean / std, atol=0.02)
    assert torch.allclose(draws.var(dim=0), variance, rtol=0.03)


@pytest.mark.slow
def test_a_mixture_learns_that_a_peg_stays_or_turns_which_one_gaussian_cannot():
    models = {n: small_models(mixture=n, dropout=0.0).gdn for n in (1, 2)}
    generator = torch.Generator().manual_seed(0)
    turned = torch.rand(64, generator=generator) < 0.5
    target = 1e-4 * torch.randn(64, 4, generator=generator)
    target[:, 3] = torch.where(turned, 1.0, 0.0) + 0.01 * torch.randn(64, generator=generator)
    same = torch.zeros(64, 1, 32, 32), torch.zeros(64, 3), torch.zeros(64), torch.zeros(64)
    losses = {}
    for n, gdn in models.items():
        torch.manual_seed(0)
        gdn.train()
        optimiser = torch.optim.Adam(gdn.parameters(), lr=3e-2)
        for _ in range(150):
            optimiser.zero_grad()
            gdn.loss(*same, target, 0.0).backward()
            optimiser.step()
        gdn.eval()
        with torch.no_grad():
            losses[n] = float(gdn.loss(*same, target, 0.0))
            mean, variance = gdn(*same)
        # Both say the mean turn, and how far outcomes lie from it.
        assert float(mean[0, 3]) == pytest.approx(0.5, abs=0.15)
        assert float(variance[0, 3]) == pytest.approx(0.25, abs=0.1)
    assert losses[2] < losses[1] - 3
