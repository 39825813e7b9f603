"""Configurations and commands from command lines."""

from __future__ import annotations

import pytest

from hal.calibrate.config import CalibrateConfig
from mskgrasp.collect.config import CollectConfig
from mskgrasp.core.errors import BadConfig, UsageError
from mskgrasp.runtime.options import parse, parse_command
from tests.runtime.small_program import COMMANDS, Eat, ProgramConfig, parse_program


def test_options_override_the_file_and_the_file_the_defaults(tmp_path):
    file, other = tmp_path / "settings.yaml", tmp_path / "other.yaml"
    file.write_text("camera: {n_pixels: 32}\nlow: 0.5\n")
    other.write_text("parts: [a, b]\n")
    for words in (["--config", str(file)], [f"--config={file}"]):
        config = parse_program("--low", "-2.5", *words, "--parts", "c", "d", default=other)
        assert config.camera.n_pixels == 32 and config.low == -2.5 and config.parts == ("c", "d")
    assert parse_program(default=other).parts == ("a", "b")
    assert parse_program() == ProgramConfig()


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
        parse_program(*arguments)
    assert message in str(caught.value) and "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_command_is_read_with_its_options():
    read = parse_command(
        COMMANDS,
        prog="program",
        description="Does.",
        argv=["eat", "pear", "--n-pieces=3"],
    )
    assert read == Eat("pear", 3)


def test_nothing_is_written_as_in_the_files():
    found = parse(CalibrateConfig, prog="p", description="d", argv=["--cell", "null", "--poses", "20"])
    assert (found.cell, found.poses) == (None, 20)


@pytest.mark.parametrize("words", [["--out", "null"], ["--parts", "nut", "null"]])
def test_nothing_is_refused_where_there_must_be_a_value(words: list[str]):
    with pytest.raises(UsageError, match=f"{words[0]} cannot be null; give a value, or omit it"):
        parse(CollectConfig, prog="p", description="d", argv=words)


def test_help_shows_the_models_docstrings(capsys):
    with pytest.raises(SystemExit):
        parse_program("--help")
    shown = capsys.readouterr().out
    assert "--camera.n-pixels" in shown and "Along an edge." in shown and "The camera." in shown


def test_help_is_not_broken_where_the_source_is(capsys):
    with pytest.raises(SystemExit):
        parse_program("--help")
    assert "Lower bound, included." in capsys.readouterr().out


def test_help_of_a_program_ends_its_description_with_the_page_about_it(capsys):
    with pytest.raises(SystemExit):
        parse(ProgramConfig, prog="python -m mskgrasp.assess", description="Says.", argv=["--help"])
    with pytest.raises(SystemExit):
        parse_command(COMMANDS, prog="python -m mskgrasp.parts", description="Does.", argv=["--help"])
    shown = capsys.readouterr().out
    assert "Explained in docs/assess.md;" in shown and "Explained in docs/parts.md;" in shown
    with pytest.raises(SystemExit):
        parse_program("--help")
    assert "Explained" not in capsys.readouterr().out
