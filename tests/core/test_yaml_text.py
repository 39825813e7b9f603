"""YAML of others: refused before it takes memory, and otherwise read as PyYAML reads it."""

from __future__ import annotations

import tracemalloc

import pytest
import yaml

from mskgrasp.core.yaml_text import MOST_ALIASES, MOST_CHARACTERS, MOST_DEPTH, MOST_VALUES, parse_yaml


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a: 1\nb: [x, 2.5, null, true]\nc: {d: {e: 2001-01-01}}\n",
        "base: &base {x: 1, y: 2}\nother: {<<: *base, y: 3}\nagain: *base\n",
        "'1': a\n1: b\n",
        "a: !!int '12'\nb: 0x10\nc: 1:30\nd: " + "9" * MOST_CHARACTERS,
        "a: " + "word " * MOST_CHARACTERS,
    ],
)
def test_sound_text_is_read_as_pyyaml_reads_it(text: str):
    assert parse_yaml(text) == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: 1\nb: 2\na: 3\n", "key 'a' occurs twice in line 3, column 1"),
        ("a: {b: 1, 'b': 1}", "key 'b' occurs twice in line 1"),
        ("- &a [*a]", "a value that contains itself"),
        ("- *a", "found undefined alias 'a' in line 1"),
        ("[" * 100_000, f"more than {MOST_DEPTH} collections"),
        ("a: &a 1\nb: [" + "*a, " * MOST_ALIASES + "*a]", f"more than {MOST_ALIASES} aliases in line 2"),
        ("9" * 5000, f"a number of more than {MOST_CHARACTERS} characters in line 1"),
        ("a: 0x" + "f" * 5000, f"a number of more than {MOST_CHARACTERS} characters"),
        ("a: 1" + ":59" * 300_000, f"a number of more than {MOST_CHARACTERS} characters"),
        ("a: 1" + ":59" * 3000 + ".5", f"a number of more than {MOST_CHARACTERS} characters"),
        ("a: 2001-99-01", "month must be in 1..12 in line 1, column 4"),
        ("a: !!int ''", "does not have the form of its tag in line 1, column 4"),
        ("a: !!bool maybe", "does not have the form of its tag"),
        ("a: !!timestamp [1]", "expected a scalar node"),
        ("a: !!timestamp soon", "does not have the form of its tag"),
        ("a: \x00", "special characters"),
        ("{[1]: 2}", "unhashable key"),
        ("--- 1\n--- 2\n", "found another document in line 2"),
    ],
)
def test_what_cannot_be_used_is_an_error_of_one_line(text: str, problem: str):
    with pytest.raises(ValueError, match=problem) as raised:
        parse_yaml(text)
    assert "\n" not in str(raised.value)


def test_aliases_of_aliases_are_refused_before_they_take_memory():
    lines = ["a0: &a0 [ha, ha, ha, ha, ha, ha, ha, ha]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 8)}]" for k in range(1, 10)]
    tracemalloc.start()
    with pytest.raises(ValueError, match=f"more than {MOST_VALUES} values"):
        parse_yaml("\n".join(lines))
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()
