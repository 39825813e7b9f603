import pytest

from mskgrasp.core.errors import BadConfig
from mskgrasp.learning.config import StageConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.runtime.options import parse
from mskgrasp.train.config import DEFAULT_CONFIG, TrainConfig, default_config


def test_the_default_settings_are_those_of_the_program_but_for_the_changes():
    shipped = parse(TrainConfig, prog="train", description="", default_config=DEFAULT_CONFIG, argv=[])
    assert default_config() == shipped
    assert default_config(epochs=3) == shipped.model_copy(update={"epochs": 3})
    with pytest.raises(BadConfig, match="epoch"):
        default_config(epoch=3)


@pytest.mark.parametrize("name", ["default", "pretrained", "paper", "paper_quick"])
def test_the_configurations_that_are_shipped_can_be_read(name):
    config = parse(
        TrainConfig,
        prog="train",
        description="",
        argv=["--config", str(DEFAULT_CONFIG.with_name(f"{name}.yaml")), "--seed", "3"],
    )
    assert config.seed == 3 and config.calibrate == ("paper" not in name)
    assert config.network.architecture == ("patch" if "paper" in name else "hand")
    assert config.network.symmetric_views == ("paper" not in name)
    if "paper" in name:
        assert config.network == PatchNetworkConfig()
    if name == "paper":
        assert config.gqn == StageConfig(
            optimiser="rmsprop",
            learning_rate=1e-5,
            decay=1e-6,
            schedule="constant",
            epochs=100,
            batch_size=32,
        )
