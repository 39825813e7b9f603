"""Errors that a user can correct; each message is one line."""

from __future__ import annotations

import reprlib

MOST_CHARACTERS = 1500
"""Longest message: it fits on a screen of 80 columns and 24 lines."""

_repr = reprlib.Repr()
_repr.maxlevel = 3
_repr.maxlist = _repr.maxtuple = _repr.maxdict = 4
_repr.maxstring = _repr.maxother = 80


def shown(value: object) -> str:
    """A value as a message shows it: its ``repr``, abbreviated where it is long; None as in YAML."""
    return "null" if value is None else _repr.repr(value)


def printable(text: str) -> str:
    """Replace characters that would control a terminal, or cannot be encoded, by their escapes.

    Names of files may hold line breaks, escape sequences, marks of right-to-left writing and bytes that
    are no UTF-8.
    """
    return "".join(one if one.isprintable() else repr(one)[1:-1] for one in text)


def first_line(error: BaseException) -> str:
    """Another package's error in one line: its class and the first line of its message."""
    first = next(iter(str(error).splitlines()), "")
    return f"{type(error).__name__}: {first}" if first else type(error).__name__


def one_line(message: object) -> str:
    """A message as one printable line that fits on a screen; the middle of a longer one is left out."""
    text = str(message)
    if len(text) > MOST_CHARACTERS:
        half = MOST_CHARACTERS // 2
        text = f"{text[:half]} ... {text[-half:]}"
    return printable(text)


class MskgraspError(Exception):
    """Base class; the message is one line with the value, the legal values and the remedy."""

    exit_code = 1


class UsageError(MskgraspError):
    """An option, or a value in a configuration file, cannot be used."""

    exit_code = 2


class BadConfig(UsageError):
    """A YAML file or a command-line override does not describe a valid configuration."""


class BadPart(MskgraspError):
    """A mesh or a part folder cannot be used as a part."""


class TapeDoesNotFit(BadPart):
    """The top of the part is too small for two tape squares."""


class UnknownPart(BadPart, UsageError):
    """No part has that name."""


class BadDataset(MskgraspError):
    """A dataset folder or one of its shards is missing, empty, truncated or of another format."""


class MissingDataset(BadDataset, UsageError):
    """There is no dataset in that folder."""


class BadModel(MskgraspError):
    """A model folder is missing, damaged, or made for other network inputs."""


class MissingModel(BadModel, UsageError):
    """There is no model in that folder."""


class BadPlanner(MskgraspError):
    """A planner of another package or program cannot be used, or answers with what is not a grasp."""


class NoPartFound(MskgraspError):
    """The depth image shows no part that could be grasped."""


class PartNotRecognised(NoPartFound):
    """What lies on the table is not the part whose CAD is known, or does not rest flat and alone."""


class TableTooHigh(MskgraspError):
    """The table is seen higher over its stated height than the fingers' clearance allows."""


class MarkersNotFound(MskgraspError):
    """The tape squares on the part are not seen well enough to measure its motion."""


class NoGraspFound(MskgraspError):
    """No candidate grasp meets the planner's criteria."""


class GraspRefused(NoGraspFound):
    """The best candidate is not worth trying: its predicted quality is under the bound.

    Attributes:
        quality: The best predicted quality; None: unknown.
    """

    def __init__(self, message: str, quality: float | None = None):
        super().__init__(message)
        self.quality = quality
