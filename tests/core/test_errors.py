"""Errors have one base class, and an exit code that says whether the command was wrong."""

from __future__ import annotations

import inspect
import os

import pytest

from hal.errors import BadRecording, MissingRecording
from mskgrasp.core import errors
from mskgrasp.core.errors import (
    MOST_CHARACTERS,
    BadConfig,
    BadDataset,
    BadModel,
    BadPart,
    MissingDataset,
    MissingModel,
    MskgraspError,
    UnknownPart,
    UsageError,
    first_line,
    one_line,
    printable,
    shown,
)

ALL = [one for _, one in inspect.getmembers(errors, inspect.isclass)]


@pytest.mark.parametrize("error", ALL)
def test_an_error_ends_a_program_with_2_where_the_command_is_wrong_and_with_1_otherwise(error):
    assert issubclass(error, MskgraspError)
    assert error("one line").exit_code == (2 if issubclass(error, UsageError) else 1)


@pytest.mark.parametrize(
    ("error", "base"),
    [
        (UnknownPart, BadPart),
        (MissingDataset, BadDataset),
        (MissingModel, BadModel),
        (MissingRecording, BadRecording),
    ],
)
def test_a_name_of_something_that_does_not_exist_is_a_wrong_command(
    error: type[MskgraspError], base: type[MskgraspError]
):
    assert issubclass(error, base) and error("one line").exit_code == 2 and base("one line").exit_code == 1


def test_a_part_that_nobody_knows_is_a_bad_part_and_a_wrong_command():
    for kind in (BadPart, UsageError):
        with pytest.raises(kind, match="no part 'x'"):
            raise UnknownPart("no part 'x'")
    assert issubclass(BadConfig, UsageError) and not issubclass(BadDataset, UsageError)


@pytest.mark.parametrize(
    "value", ["x" * 10_000, list(range(10_000)), [[[[["deep"]]]]], 10**4000, {"a": "b" * 999}]
)
def test_a_value_in_a_message_is_short(value: object):
    assert len(shown(value)) < 400


def test_a_short_value_is_shown_as_it_is():
    for value in ("word", 3, 2.5, ["a", 1], {"a": 1}):
        assert shown(value) == repr(value)
    assert shown(None) == "null"  # as in the files


def test_an_error_of_another_package_is_its_class_and_its_first_line():
    assert first_line(ValueError("no such port\nsee the manual")) == "ValueError: no such port"
    assert first_line(KeyboardInterrupt()) == "KeyboardInterrupt"


def test_a_message_is_one_line_that_cannot_control_the_terminal():
    name = os.fsdecode(b"\x1b[31m\n\xff") + "\u202e\u2028ü"
    assert printable(name) == r"\x1b[31m\n\udcff\u202e\u2028ü"
    assert one_line(f"{name}: cannot be read") == printable(name) + ": cannot be read"
    long = one_line("first" + "x" * 10_000_000 + "last")
    assert len(long) < MOST_CHARACTERS + 10 and long.startswith("first") and long.endswith("last")
