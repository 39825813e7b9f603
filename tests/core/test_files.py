from __future__ import annotations

import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest

from mskgrasp.core.files import write_whole


def write_for_ever(path: Path, letter: bytes) -> None:
    while True:
        write_whole(path, letter * 200_000)


def test_two_writers_of_one_file_killed_at_any_moment_leave_a_whole_one(tmp_path):
    path = tmp_path / "data"
    write_whole(path, b"a" * 200_000)
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=write_for_ever, args=(path, letter)) for letter in (b"b", b"c")]
    for writer in writers:
        writer.start()
    seen = set()
    deadline = time.monotonic() + 60
    while len(seen - {b"a"}) < 2 and time.monotonic() < deadline:
        content = path.read_bytes()
        assert len(content) == 200_000 and len(set(content)) == 1
        seen.add(content[:1])
    for writer in writers:
        assert writer.is_alive() and writer.pid is not None
        os.kill(writer.pid, signal.SIGKILL)
        writer.join()
        writer.close()
    content = path.read_bytes()
    assert len(content) == 200_000 and len(set(content)) == 1
    assert seen >= {b"b", b"c"}
    assert all(other.suffix == ".tmp" for other in tmp_path.iterdir() if other != path)


def test_a_file_that_cannot_be_written_leaves_the_old_one_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "data"
    write_whole(path, b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]
