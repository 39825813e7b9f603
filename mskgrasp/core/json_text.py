"""Parsing of JSON text that may be malformed or malicious, and of records in it."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from typing import Annotated, Any, TypeVar, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model

Record = TypeVar("Record")
Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Four = Annotated[list[float], Field(min_length=4, max_length=4)]
Seven = Annotated[list[float], Field(min_length=7, max_length=7)]


_MOST_DIGITS = 300
"""Digits of an integer; any of so many is a float, too."""


def parse_json(text: str | bytes, *, constants: bool = False) -> Any:
    """Parse JSON in which no object has a key twice, and all numbers are finite.

    Args:
        text: The JSON.
        constants: Accept NaN and the infinities, which JSON does not have but Python writes.

    Raises:
        ValueError: It is not valid, has a key twice, a number that is not finite or too large for a float, or
            more brackets inside each other than can be read.
    """
    try:
        return json.loads(
            text,
            object_pairs_hook=_without_doubles,
            parse_float=_fraction,
            parse_int=_integer,
            parse_constant=float if constants else _no_number,
        )
    except RecursionError as error:
        raise ValueError("too many brackets inside each other") from error


def finite(value: Any) -> Any:
    """The value with null for each number in it that JSON does not have: NaN and the infinities."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def checked(record: Record) -> Record:
    """The record, an instance of a dataclass, if its fields hold what they are annotated with.

    Raises:
        ValueError: One does not.
    """
    _fields_of(type(record)).model_validate(vars(record))
    return record


@cache
def _fields_of(kind: type) -> type[BaseModel]:
    hints = get_type_hints(kind, include_extras=True)
    wanted: dict[str, Any] = {field.name: (hints[field.name], ...) for field in fields(kind)}
    return create_model(kind.__name__, __config__=ConfigDict(strict=True), **wanted)


def _fraction(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"{_start(text)} is too large")
    return value


def _integer(text: str) -> int:
    if len(text) > _MOST_DIGITS:
        raise ValueError(f"{_start(text)} is too large")
    return int(text)


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _start(text: str) -> str:
    return text if len(text) <= 20 else f"{text[:20]}..."


def _without_doubles(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(name for name, _ in pairs)
        raise ValueError(f"key {next(name for name, n in counts.items() if n > 1)!r} occurs twice")
    return found
