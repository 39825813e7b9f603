from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from mskgrasp.core import files
from mskgrasp.core.files import LOCK, is_leftover, read_bounded, require_space, write_figure, write_whole


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


def test_a_file_that_is_there_keeps_its_permissions(tmp_path):
    path = tmp_path / "data"
    write_whole(path, b"old")
    path.chmod(0o640)
    write_whole(path, b"new")
    assert path.read_bytes() == b"new" and path.stat().st_mode & 0o777 == 0o640


def test_a_file_that_cannot_be_written_leaves_the_old_one_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "data"
    write_whole(path, b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space") as raised:
        write_whole(path, b"new")
    assert raised.value.filename == str(path) and raised.value.errno == 28
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_limit_of_the_system_is_an_error_with_the_files_name(tmp_path):
    code = (
        "import resource, sys\nfrom pathlib import Path\nfrom mskgrasp.core.files import write_whole\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try:\n    write_whole(Path(sys.argv[1]), bytes(5000))\n"
        "except OSError as error:\n    print(error.filename)"
    )
    path = tmp_path / "data"
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True)
    assert done.stdout == f"{path}\n" and not list(tmp_path.iterdir())


def test_no_more_is_read_than_is_allowed(tmp_path):
    path = tmp_path / "data"
    path.write_bytes(b"12345")
    assert read_bounded(path, 5) == b"12345"
    for large, most in ((path, 4), (Path("/dev/zero"), 1000)):
        with pytest.raises(OSError, match=f"larger than {most:,} bytes") as raised:
            read_bounded(large, most)
        assert raised.value.filename == str(large)


def test_what_a_killed_writer_leaves_is_known_by_its_name(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "replace", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
    if os.fork() == 0:
        write_whole(tmp_path / "data", b"new")
        os._exit(0)
    os.wait()
    (left,) = tmp_path.iterdir()
    assert is_leftover(left) and is_leftover(tmp_path / LOCK) and not is_leftover(tmp_path / "data")


def test_room_is_required_of_the_disk_of_a_file(tmp_path, monkeypatch):
    require_space(tmp_path / "data")
    monkeypatch.setattr("mskgrasp.core.files.LEAST_FREE", 2**62)  # more than any disk has
    with pytest.raises(OSError, match="No space left on device") as raised:
        require_space(tmp_path / "data")
    assert raised.value.filename == str(tmp_path / "data")


def test_a_figure_is_written_in_the_format_of_its_suffix_and_an_error_names_it(tmp_path):
    figure = Figure(figsize=(1, 1))
    for suffix, start in ((".png", b"\x89PNG"), (".PDF", b"%PDF"), (".svg", b"<?xml")):
        write_figure(figure, tmp_path / f"one{suffix}", dpi=20)
        assert (tmp_path / f"one{suffix}").read_bytes().startswith(start)
    with pytest.raises(OSError) as raised:
        write_figure(figure, tmp_path / "none" / "one.png")
    assert raised.value.filename == str(tmp_path / "none" / "one.png")


def test_a_file_system_without_locks_is_named_with_a_remedy(tmp_path, monkeypatch):
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(files.fcntl, "flock", no_locks)
    with pytest.raises(OSError, match="has no locks; choose a folder on another") as raised, \
         files.exclusive_lock(tmp_path):  # fmt: skip
        pass
    assert raised.value.filename == str(tmp_path)
