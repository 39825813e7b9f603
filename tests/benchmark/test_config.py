from pathlib import Path

import pytest

from mskgrasp.benchmark.config import BUILT_IN, BenchmarkConfig
from mskgrasp.core.config import read_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.evaluate.config import EvaluateConfig
from mskgrasp.runtime.options import parse


def parsed(*argv: str) -> BenchmarkConfig:
    return parse(BenchmarkConfig, prog="benchmark", description="", argv=argv)


def test_by_default_all_planners_run_that_can():
    assert parsed().rows == tuple(name for name in BUILT_IN if name != "paper")
    assert parsed("--paper-models", "models/paper").rows == BUILT_IN
    assert "certified" not in parsed("--quick").rows
    assert parsed("--program", "planner").rows[-1] == "program"
    assert parsed("--quick", "--planners", "certified", "mine").rows == ("certified", "mine")


def test_the_whole_form_makes_two_thousand_attempts():
    assert 60 * parsed().n_trials * len(parsed().rows) >= 2000
    assert parsed("--quick").n_trials < parsed().n_trials
    assert parsed("--quick", "--trials", "9").n_trials == 9


def test_a_cell_is_one_of_two_names_or_a_file():
    assert parsed().cell_file.name == "sapien.yaml" and parsed().cell_file.is_file()
    assert parsed("--cell", "mujoco").cell_file.is_file()
    assert parsed("--cell", "my/cell.yaml").cell_file == Path("my/cell.yaml")


def test_a_planner_named_twice_is_refused():
    with pytest.raises(BadConfig, match="named twice"):
        parsed("--planners", "ours", "ours")


def test_noise_can_be_switched_off_in_a_file_and_on_the_command_line(tmp_path: Path):
    """YAML reads a bare ``off`` as false."""
    file = tmp_path / "settings.yaml"
    file.write_text("noise: off\n")
    for config in (
        parsed("--config", str(file)),
        parsed("--noise", "off"),
        read_config(EvaluateConfig, file),
    ):
        assert config.noise == "off"
