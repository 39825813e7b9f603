"""Files that are there whole or not at all, whatever happens while they are written."""

from __future__ import annotations

import fcntl
import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOCK = ".lock"


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file so that either all of it or what was there before is ever seen under its name.

    It is written beside it under a name of its own, ``<name>.<random>.tmp``, synced and renamed: two
    processes that write the same file, on one machine or two, do not disturb each other. A process that is
    killed leaves that file behind.

    Raises:
        OSError: The disk is full or not writable; nothing is left behind.
    """
    path = Path(path)
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}.tmp")
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@contextmanager
def only_here(folder: Path) -> Iterator[bool]:
    """Whether no other process has this folder, which is this one's until the end of the block.

    The operating system frees it when a process dies, however it does; an empty file stays behind.
    """
    with open(Path(folder) / LOCK, "w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True
