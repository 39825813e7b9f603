import pytest

from mskgrasp.learning.config import StageConfig
from mskgrasp.learning.network_config import PatchNetworkConfig
from mskgrasp.runtime.options import parse
from mskgrasp.train.config import DEFAULT_CONFIG, TrainConfig


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
