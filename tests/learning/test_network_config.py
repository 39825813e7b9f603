import pytest
from pydantic import ValidationError

from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.learning.config import LearningConfig
from mskgrasp.learning.network_config import HandNetworkConfig, Normalisation, PatchNetworkConfig


def test_a_file_chooses_the_architecture_by_its_name():
    for name, kind in (("patch", PatchNetworkConfig), ("hand", HandNetworkConfig)):
        values = {"network": {"architecture": name, "patch_pixels": 48}}
        network = check_config(LearningConfig, values, "x.yaml").network
        assert type(network) is kind and network.patch_shape == (48, 48)
        assert check_config(LearningConfig, {"network": network.model_dump()}, "again").network == network


@pytest.mark.parametrize(
    ("network", "words"),
    [
        ({}, "architecture is missing; legal: patch, hand"),
        ({"architecture": "cnn"}, "unknown architecture 'cnn'; legal: patch, hand"),
        (
            {"architecture": "patch", "layers": [8]},
            "unknown key 'network.patch.layers'; legal keys here: action",
        ),
        ({"architecture": "patch", "patch_columns": 64}, "unknown key 'network.patch.patch_columns'"),
        (
            {"architecture": "hand", "channels": 8},
            "unknown key 'network.hand.channels'; legal keys here: action",
        ),
        ({"architecture": "hand", "image": "object"}, "unknown key 'network.hand.image'"),
        ({"architecture": "patch", "patch_pixels": 16}, "greater than or equal to 32, got 16"),
        (
            {"architecture": "patch", "image": "object", "symmetric_views": True},
            "symmetric_views needs patches",
        ),
        ({"architecture": "hand", "layers": [8, 0]}, "greater than or equal to 1, got 0"),
        ({"architecture": "hand", "displacement_layers": [513]}, "less than or equal to 512, got 513"),
        ({"architecture": "hand", "quality_stride": 3, "patch_pixels": 33}, "quality_stride 3 must divide"),
        ({"architecture": "hand", "patch_pixels": 33, "quality_columns": 16}, "same number of the patch's"),
        ({"architecture": "hand", "patch_pixels": 33, "quality_columns": 35}, "same number of the patch's"),
        ({"architecture": "hand", "least_std": [0.1, -0.1]}, "must be finite and not negative"),
    ],
)
def test_a_network_that_cannot_be_built_is_refused_in_one_line(network, words):
    with pytest.raises(BadConfig, match=words) as caught:
        check_config(LearningConfig, {"network": network}, "x.yaml")
    assert "\n" not in str(caught.value)


def test_the_quality_network_gets_one_pixel_in_so_many_of_the_middle_columns():
    network = HandNetworkConfig(patch_pixels=65, patch_columns=33, patch_side=0.13, quality_stride=2)
    assert (network.patch_shape, network.quality_shape) == ((65, 33), (33, 17))
    assert network.pixel == pytest.approx(0.002)
    assert network.model_copy(update={"quality_columns": 9}).quality_shape == (33, 9)
    paper = PatchNetworkConfig()
    assert paper.quality_shape == paper.patch_shape == (64, 64) and paper.pixel == pytest.approx(0.002)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("inf"), float("nan")])
def test_scales_that_cannot_be_divided_by_are_refused(scale):
    with pytest.raises(ValidationError, match="positive and finite|finite number"):
        Normalisation(action_scale=(0.1, scale, 0.1))
