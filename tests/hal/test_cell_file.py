"""Values written into texts of cell files; all else stays to the letter."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from hal.cell_file import number, require_writable, with_values, write_values
from mskgrasp.core.errors import BadConfig, UsageError


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("w:\n  a: 1  # one\n  # next\n  b: 2\n", "w:\n  a: 1  # one\n  grip: {f: 3.5}\n  # next\n  b: 2\n"),
        ("w:\n  a: 1\n  grip: {f: 2}  # old\n", "w:\n  a: 1\n  grip: {f: 3.5}  # old\n"),
        ("w: {a: 1, b: 2}\n", "w: {a: 1, grip: {f: 3.5}, b: 2}\n"),
        ("w:\n  a:", "w:\n  a:\n  grip: {f: 3.5}"),
        ("w:\n  a: [1,\n    2]\n  b: 2\n", "w:\n  a: [1,\n    2]\n  grip: {f: 3.5}\n  b: 2\n"),
        ("w:\n  grip:\n  a: 1\n", "w:\n  grip: {f: 3.5}\n  a: 1\n"),
        (
            "w:\n  grip:\n    f: 2  # newtons\n    g: 3\n  # b\n  a: 1\n",
            "w:\n  grip:\n    {f: 3.5}\n  # b\n  a: 1\n",
        ),
        ("w:\n  a:\n    - 1\n    - 2\nv: 3\n", "w:\n  a:\n    - 1\n    - 2\n  grip: {f: 3.5}\nv: 3\n"),
    ],
)
def test_every_way_to_write_it_is_edited(before: str, after: str):
    assert with_values(before, "w", {"grip": "{f: 3.5}"}, after="a") == after
    assert yaml.safe_load(after)["w"]["grip"] == {"f": 3.5}


def test_an_empty_anchor_is_filled_and_followed_by_what_is_new():
    assert with_values("w:\n  a:", "w", {"a": "1.5", "b": "2"}, after="a") == "w:\n  a: 1.5\n  b: 2"
    assert with_values("w: {a: }", "w", {"a": "1.5", "b": "2"}, after="a").count("a:  1.5, b: 2") <= 1
    assert yaml.safe_load(with_values("w: {a: }", "w", {"a": "1", "b": "2"}, after="a"))["w"] == {
        "a": 1,
        "b": 2,
    }


@pytest.mark.parametrize("text", ["", "w: 3", "w: {b: 1}", "a: 1", "- w"])
def test_a_file_without_the_section_is_refused(text: str):
    with pytest.raises(BadConfig, match=r"no w\.a; write 'a: null' there"):
        with_values(text, "w", {"b": "1"}, after="a")


def test_a_file_keeps_its_line_ends_and_permissions(tmp_path: Path):
    path = tmp_path / "cell.yaml"
    path.write_bytes(b"type: real\r\nw:\r\n  a: 1  # first\r\n")
    path.chmod(0o664)
    write_values(path, "w", {"b": "2"}, after="a")
    assert path.read_bytes() == b"type: real\r\nw:\r\n  a: 1  # first\r\n  b: 2\r\n"
    assert path.stat().st_mode & 0o777 == 0o664


def test_a_text_that_cannot_be_edited_is_left_as_it_is(tmp_path: Path):
    """An alias: the same value would change in two places."""
    path = tmp_path / "cell.yaml"
    path.write_text("v: &v {a: 1}\nw: *v\n")
    with pytest.raises(BadConfig, match="write grip: 3 into w by hand"):
        write_values(path, "w", {"grip": "3"}, after="a")
    assert path.read_text() == "v: &v {a: 1}\nw: *v\n"


def test_a_file_that_is_not_writable_is_refused_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "cell.yaml"
    path.write_text("w: {a: 1}\n")
    require_writable(path, "the table", "w", {"a": "2"}, after="a")
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(UsageError, match="is not writable; the table is written there"):
        require_writable(path, "the table", "w", {"a": "2"}, after="a")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "v: &v {a: 1}\nw: *v\n",
            "the table could not be written into w, whose text stands for other places, too; write the",
        ),
        ("w: {b: 1}\n", "the file has no w.a; write 'a: null'"),
    ],
)
def test_a_text_that_cannot_be_edited_is_refused_before_anything_is_measured(
    tmp_path: Path, text: str, message: str
):
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with pytest.raises(BadConfig) as caught:
        require_writable(path, "the table", "w", {"a": "2"}, after="a")
    assert message in str(caught.value) and str(path) in str(caught.value) and path.read_text() == text


def test_numbers_are_written_without_exponents():
    assert [number(value) for value in (1e-5, -1e-7, 30.0, 0.04999, 2.0)] == [
        "0.00001", "0.0", "30.0", "0.04999", "2.0",
    ]  # fmt: skip
