import pytest

from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig


def test_views_that_the_network_never_learned_are_refused():
    with pytest.raises(ValueError, match="needs symmetric: true"):
        LearningConfig(symmetric=False, network=PatchNetworkConfig(symmetric_views=True))


def test_turned_samples_need_pictures_that_turn():
    with pytest.raises(ValueError, match="symmetric"):
        LearningConfig(network=PatchNetworkConfig(image="object"), symmetric=True)


def test_a_mixture_is_trained_by_its_likelihood_and_has_variances():
    with pytest.raises(ValueError, match="beta: 0.5 needs network.mixture: 1"):
        LearningConfig(beta=0.5, network=PatchNetworkConfig(mixture=3))
    with pytest.raises(ValueError, match="mixture: 3 needs variance: true"):
        PatchNetworkConfig(mixture=3, variance=False)
    with pytest.raises(ValueError, match="mixture needs patches that are rotated"):
        PatchNetworkConfig(mixture=3, image="object")


@pytest.mark.parametrize("bounds", [(0.9, 0.1), (-0.1, 0.5), (0.5, 1.1)])
def test_a_success_range_is_of_shares_from_low_to_high(bounds):
    with pytest.raises(ValueError, match="must be shares from low to high"):
        LearningConfig(success_range=bounds)
