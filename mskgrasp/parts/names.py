"""Names of parts and of sets of parts."""

from __future__ import annotations

import re
import unicodedata
from typing import Literal

from mskgrasp.core.errors import BadPart

Split = Literal["train", "validation", "test", "new_sizes"]
SPLITS: tuple[Split, ...] = ("train", "validation", "test", "new_sizes")
SETS: tuple[str, ...] = ("starter", "catalogue", "all", *SPLITS)
"""Words that stand for several parts, and cannot be the name of one."""
LEGAL_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}")

_TRANSLITERATION = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "ø": "oe", "å": "aa", "æ": "ae"}
)


def legal_name(text: str) -> str:
    """A legal part name from any text: lower case letters, digits, - and _.

    Raises:
        BadPart: The text has no legal character.
    """
    plain = unicodedata.normalize("NFC", text).lower().translate(_TRANSLITERATION)
    plain = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
    name = re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-_")[:80].rstrip("-_")
    if not LEGAL_NAME.fullmatch(name):
        raise BadPart(f"no part name can be made of {text!r}: give one with --name (a-z, 0-9, - and _)")
    return name
