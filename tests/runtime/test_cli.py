"""Exit code and the line on standard error of a program that ends."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.runtime.cli import check_folder, run


def _raise(error: BaseException) -> None:
    raise error


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (UsageError("--seed: -1 is negative"), 2, "program: --seed: -1 is negative"),
        (BadPart("a.stl is empty"), 1, "program: a.stl is empty"),
        (FileNotFoundError(errno.ENOENT, "No such file", "a.stl"), 1, "program: No such file: a.stl; "),
        (OSError(errno.ENOSPC, "No space left on device"), 1, "program: No space left on device; free"),
    ],
)
def test_an_error_that_a_user_can_correct_is_one_line_after_the_programs_name(error, code, line, capsys):
    with pytest.raises(SystemExit) as ended:
        run("program", lambda: _raise(error))
    shown = capsys.readouterr().err
    assert ended.value.code == code and shown.startswith(line) and shown.count("\n") == 1


def test_a_defect_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError):
        run("program", lambda: 1 // 0)


def test_the_exit_code_is_that_of_the_program():
    for given, code in ((None, 0), (0, 0), (3, 3)):
        with pytest.raises(SystemExit) as ended:
            run("program", lambda given=given: given)
        assert ended.value.code == code


def _ended(main: str) -> tuple[int, str]:
    """Exit code and errors of a program whose standard output nobody reads."""
    code = f"from mskgrasp.runtime.cli import run\nrun('program', lambda: {main})"
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], stdout=writer, stderr=subprocess.PIPE, text=True, timeout=120
        )
    finally:
        os.close(writer)
    return done.returncode, done.stderr


def test_a_program_whose_output_nobody_reads_fails_as_one_that_sigpipe_ends():
    assert _ended("print('1 bad file') or 1") == (141, "")


def test_a_pipe_that_breaks_elsewhere_is_a_defect(monkeypatch):
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
    reader, writer = os.pipe()
    os.close(reader)
    try:
        with pytest.raises(BrokenPipeError):
            run("program", lambda: os.write(writer, b"x"))
    finally:
        os.close(writer)


def test_what_is_printed_shows_at_once_and_may_hold_any_name(monkeypatch):
    pipe = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(pipe, encoding="utf-8"))
    seen = []

    def main() -> None:
        print("wrote", os.fsdecode(b"a-file-called-\xff"))
        seen.append(pipe.getvalue())

    with pytest.raises(SystemExit):
        run("program", main)
    assert seen == [b"wrote a-file-called-\\udcff\n"]


def test_a_folder_that_cannot_be_made_is_refused_and_none_is_made(tmp_path: Path):
    (tmp_path / "file").write_text("in the way")
    check_folder(tmp_path / "new" / "folder")
    assert not (tmp_path / "new").exists()
    for path in (tmp_path / "file", tmp_path / "file" / "folder"):
        with pytest.raises(UsageError, match=r"cannot make folder .*file is a file; choose another --out"):
            check_folder(path)
