"""Version numbers of part building and importing.

Whoever changes an outcome raises the number; parts made with another number are made anew.
`tests/versions.py` names the files that each number stands for.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

PART_VERSION = 1
"""Of what turns a solid into a part: pieces, decomposition, measures, resting poses, files."""

IMPORT_VERSION = 1
"""Of what reads, repairs and simplifies a user's mesh."""

_FIRST = Path(__file__).parent / "first_versions.json"


def stamp(what: str, version: int) -> str:
    """The text that stands for a version in a recipe's hash.

    Version 1 keeps the digest of source files that parts carried before versions were numbered, so that those
    parts remain current.

    Args:
        what: ``part``, ``import``, or a recipe's module as ``families.gears``.
        version: Its number.
    """
    return _first_stamps().get(what, "1") if version == 1 else str(version)


@lru_cache(maxsize=1)
def _first_stamps() -> dict[str, str]:
    return json.loads(_FIRST.read_text(encoding="utf-8"))
