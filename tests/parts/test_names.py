"""Names of parts."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import BadPart
from mskgrasp.parts import builtin_names
from mskgrasp.parts.names import LEGAL_NAME, SETS, legal_name


def test_built_in_parts_have_legal_names_none_of_which_stands_for_a_set():
    names = builtin_names()
    assert all(LEGAL_NAME.fullmatch(name) for name in names) and not set(names) & set(SETS)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Größe 3", "groesse-3"),
        ("../../etc/passwd", "etc-passwd"),
        ("M8_Nut-v2", "m8_nut-v2"),
        ("Écrou", "ecrou"),
        ("a" * 300, "a" * 80),
    ],
)
def test_names_are_made_legal_and_never_leave_the_folder(text, name):
    assert legal_name(text) == name


@pytest.mark.parametrize("text", ["", "...", "部品", "--"])
def test_a_name_of_which_nothing_is_left_is_refused(text):
    with pytest.raises(BadPart, match="--name"):
        legal_name(text)
