"""Parsing of JSON text that may be malformed or malicious."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any


def parse_json(text: str | bytes) -> Any:
    """Parse JSON in which no object has a key twice.

    Raises:
        ValueError: It is not valid, has a key twice, or more brackets inside each other than can be read.
    """
    try:
        return json.loads(text, object_pairs_hook=_without_doubles)
    except RecursionError as error:
        raise ValueError("too many brackets inside each other") from error


def _without_doubles(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(name for name, _ in pairs)
        raise ValueError(f"key {next(name for name, n in counts.items() if n > 1)!r} occurs twice")
    return found
