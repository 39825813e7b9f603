"""JSON of others."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Literal, cast

import pytest

from mskgrasp.core.json_text import Four, Three, checked, finite, parse_json


def test_sound_text_is_read():
    assert parse_json(b'{"a": [1, {"a": null}], "b": "\\u00fc"}') == {"a": [1, {"a": None}], "b": "ü"}


def test_numbers_that_json_does_not_have_become_null():
    values = {"a": [1.5, math.nan, (math.inf, 2)], "b": {"c": -math.inf, "d": "nan"}, "e": True}
    assert finite(values) == {"a": [1.5, None, [None, 2]], "b": {"c": None, "d": "nan"}, "e": True}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" * 100_000, "too many brackets"),
        ('{"a": {"b": 1, "c": 2, "b": 3}}', "key 'b' occurs twice"),
        ("{", "Expecting property name"),
        (b"\xff\xff", "decode"),
        ("", "Expecting value"),
        ("[1, NaN]", "NaN is no number of JSON"),
        ('{"a": -Infinity}', "-Infinity is no number of JSON"),
        ("1e400", "1e400 is too large"),
        ("[-1" + "0" * 400 + "]", r"-10{18}\.\.\. is too large"),
        ("1" * 5000, r"1{20}\.\.\. is too large"),
    ],
)
def test_what_cannot_be_used_is_a_value_error_of_one_line(text: str | bytes, problem: str):
    with pytest.raises(ValueError, match=problem) as raised:
        parse_json(text)
    assert "\n" not in str(raised.value)


def test_numbers_of_every_legal_size_are_read_and_constants_where_they_are_accepted():
    assert parse_json("[18446744073709551615, -1e308, 5e-324, 1e-400]") == [2**64 - 1, -1e308, 5e-324, 0.0]
    values = parse_json("[NaN, Infinity, -Infinity]", constants=True)
    assert math.isnan(values[0]) and values[1:] == [math.inf, -math.inf]


def test_a_key_that_occurs_twice_is_found_among_many_in_no_time():
    n = 100_000  # in 100 s, if every key is compared with every other
    text = "{" + ", ".join(f'"{k}": 0' for k in (*range(n), n - 1)) + "}"
    began = time.monotonic()
    with pytest.raises(ValueError, match=f"key '{n - 1}' occurs twice"):
        parse_json(text)
    assert time.monotonic() - began < 10


@dataclass(frozen=True)
class Kept:
    name: str
    at: Three
    grasp: Four | None = None
    how: Literal["so", "thus"] = "so"


def test_a_record_holds_what_its_fields_say():
    assert checked(Kept("a", [1.0, 2, math.nan])).at[:2] == [1.0, 2]
    for wrong in (
        Kept("a", [1.0, 2.0]), Kept(cast(Any, 3), [1.0] * 3), Kept("a", [cast(Any, "1")] * 3),
        Kept("a", [1.0] * 3, [1.0] * 5), Kept("a", [1.0] * 3, how=cast(Any, "foo")),
    ):  # fmt: skip
        with pytest.raises(ValueError):
            checked(wrong)
