import pytest

from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import PatchNetworkConfig


def test_views_that_the_network_never_learned_are_refused():
    with pytest.raises(ValueError, match="needs symmetric: true"):
        LearningConfig(symmetric=False, network=PatchNetworkConfig(symmetric_views=True))


def test_turned_samples_need_pictures_that_turn():
    with pytest.raises(ValueError, match="symmetric"):
        LearningConfig(network=PatchNetworkConfig(image="object"), symmetric=True)
