"""Version numbers of part building and importing.

A change of the outcome raises the number; parts made with another number are rebuilt.
`tests/versions.py` lists the files that each number covers.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

PART_VERSION = 2
"""Building a part from a solid: pieces, decomposition, measurements, stable poses, files."""

IMPORT_VERSION = 4
"""Reading, repairing and simplifying an imported mesh, and its convex pieces."""

_FIRST = Path(__file__).parent / "first_versions.json"


def stamp(what: str, version: int) -> str:
    """The text that represents a version in a recipe's hash.

    Version 1 keeps the digest of source files that parts carried before versions were numbered, so that those
    parts remain up to date.

    Args:
        what: ``part``, ``import``, or a recipe's module as ``families.gears``.
        version: Its number.
    """
    return _first_stamps().get(what, "1") if version == 1 else str(version)


@lru_cache(maxsize=1)
def _first_stamps() -> dict[str, str]:
    return json.loads(_FIRST.read_text(encoding="utf-8"))
