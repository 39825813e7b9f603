"""Configurations and commands from command lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest
import tyro
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.runtime.options import parse, parse_command


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
    kind: Literal["apple", "pear"] = "apple"
    """Kind of fruit."""

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


HELP = "; program --help lists what is legal"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--camera.n-pixels", "many"], "--camera.n-pixels needs INT, got many"),
        (["--camera.n_pixels=many"], "--camera.n-pixels needs INT, got many"),
        (["--camera.pixels", "64"], "unknown option --camera.pixels; similar: --camera.n-pixels"),
        (["--confg", "a.yaml"], "unknown option --confg; similar: --config"),
        (["--zzz"], "unknown option --zzz"),
        (["--low"], "--low needs FLOAT"),
        (["--low", "1", "2"], "unexpected argument '2'"),
        (["--kind", "orange"], "--kind: 'orange' is not legal; legal: apple, pear"),
    ],
)
def test_an_argument_that_cannot_be_parsed_is_one_line_with_what_is_legal(arguments, message, capsys):
    with pytest.raises(UsageError) as caught:
        _parse(*arguments)
    assert str(caught.value) == message + HELP
    assert capsys.readouterr() == ("", "")


@dataclass(frozen=True)
class Eat:
    """Eat fruit."""

    fruit: tyro.conf.Positional[str]
    """Which."""
    n_pieces: int = 1
    """How many."""


@dataclass(frozen=True)
class Drink:
    """Drink."""


@dataclass(frozen=True)
class Pay:
    """Pay."""

    amount: float
    """How much."""


COMMANDS = {"eat": Eat, "drink": Drink, "pay": Pay}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "a command is missing; legal: eat, drink, pay" + HELP),
        (["drnk"], "unknown command 'drnk'; legal: eat, drink, pay"),
        (["eat"], "missing: fruit (STR)" + HELP),
        (["eat", "pear", "--peaces", "2"], "unknown option --peaces; similar: --n-pieces" + HELP),
        (["pay", "--amont", "2"], "unknown option --amont; similar: --amount" + HELP),
        (["pay"], "missing: --amount (FLOAT)" + HELP),
        (["drink", "water"], "unexpected argument 'water'" + HELP),
        (["eat", "pear", "--n-pieces"], "--n-pieces needs INT; program eat --help lists what is legal"),
    ],
)
def test_a_wrong_command_is_one_line_with_what_is_legal(arguments, message, capsys):
    with pytest.raises(UsageError) as caught:
        parse_command(COMMANDS, prog="program", description="Does.", argv=arguments)
    assert str(caught.value) == message
    assert capsys.readouterr() == ("", "")


def test_a_command_is_read_with_its_options():
    read = parse_command(
        COMMANDS,
        prog="program",
        description="Does.",
        argv=["eat", "pear", "--n-pieces=3"],
    )
    assert read == Eat("pear", 3)


def test_help_shows_the_models_docstrings(capsys):
    with pytest.raises(SystemExit):
        _parse("--help")
    shown = capsys.readouterr().out
    assert "--camera.n-pixels" in shown and "Along an edge." in shown and "The camera." in shown
