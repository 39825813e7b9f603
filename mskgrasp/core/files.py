"""Atomic writing of files, and exclusive use of folders."""

from __future__ import annotations

import fcntl
import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOCK = ".lock"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically: its name always refers to the old content or to all of the new.

    The content is written to ``<name>.<random>.tmp`` in the same folder, synced and renamed, so that several
    processes, on one machine or more, can write the same file. A process that is killed leaves its temporary
    file behind.

    Raises:
        OSError: The disk is full or not writable; no temporary file is left behind.
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
def exclusive_lock(folder: Path) -> Iterator[bool]:
    """Lock a folder until the end of the block; give False if another process holds the lock.

    The operating system releases the lock when a process ends for whatever reason; its empty file remains.
    """
    with open(Path(folder) / LOCK, "w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True
