"""What every program makes of its command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadConfig
from mskgrasp.runtime.options import parse


class CameraConfig(Config):
    """Of the camera."""

    n_pixels: int = Field(default=64, ge=16)
    """Along an edge."""


class ProgramConfig(Config):
    """Settings."""

    camera: CameraConfig = CameraConfig()
    """The camera."""
    parts: tuple[str, ...] = ()
    """Names."""
    low: float = 0.0
    """Lower bound."""
    high: float = 1.0
    """Upper bound."""

    @model_validator(mode="after")
    def _in_order(self) -> ProgramConfig:
        if self.low > self.high:
            raise ValueError(f"low {self.low} is above high {self.high}; Swap them")
        return self


def _parse(*arguments: str, default: Path | None = None) -> ProgramConfig:
    return parse(ProgramConfig, prog="program", description="Does.", default_config=default, argv=arguments)


def test_options_override_the_file_and_the_file_the_defaults(tmp_path):
    file, other = tmp_path / "settings.yaml", tmp_path / "other.yaml"
    file.write_text("camera: {n_pixels: 32}\nlow: 0.5\n")
    other.write_text("parts: [a, b]\n")
    for words in (["--config", str(file)], [f"--config={file}"]):
        config = _parse("--low", "-2.5", *words, "--parts", "c", "d", default=other)
        assert config.camera.n_pixels == 32 and config.low == -2.5 and config.parts == ("c", "d")
    assert _parse(default=other).parts == ("a", "b")
    assert _parse() == ProgramConfig()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--camera.n-pixels", "3"], "--camera.n-pixels: input should be greater than or equal to 16, got 3"),
        (["--low", "2"], "command line: low 2.0 is above high 1.0; Swap them"),
        (["--low", "nan", "--camera.n-pixels", "0"], "--camera.n-pixels: "),
        (["--config"], "--config needs a file"),
        (["--config", "--low", "1"], "--config needs a file"),
        (["--config", "nowhere.yaml"], "cannot read configuration nowhere.yaml"),
    ],
)
def test_an_illegal_value_is_one_line_that_names_the_option_and_its_group(arguments, message):
    with pytest.raises(BadConfig) as caught:
        _parse(*arguments)
    assert message in str(caught.value) and "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("arguments", [["--camera.n-pixels", "many"], ["--camera.pixels", "64"]])
def test_an_unknown_option_and_a_value_of_another_type_end_with_a_usage_error(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        _parse(*arguments)
    assert ended.value.code == 2 and arguments[0] in capsys.readouterr().err


def test_help_shows_the_models_docstrings(capsys):
    with pytest.raises(SystemExit):
        _parse("--help")
    shown = capsys.readouterr().out
    assert "--camera.n-pixels" in shown and "Along an edge." in shown and "The camera." in shown
