"""Atomic writing and bounded reading of files, and exclusive use of folders."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import io
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOCK = ".lock"
LEAST_FREE = 2**26
"""Least free space of a disk for `require_space`, bytes."""


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically: its name always refers to the old content or to all of the new.

    The content is written to ``<name>.<random>.tmp`` in the same folder, synced and renamed, so that several
    processes, on one machine or more, can write the same file. A file that is there keeps its permissions. A
    process that is killed leaves its temporary file behind.

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
        with contextlib.suppress(FileNotFoundError):
            shutil.copymode(path, temporary)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        # An error of writing, as on a full disk, does not name the file.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def write_figure(figure: Figure, path: Path, **options: Any) -> None:
    """Write a figure atomically, in the format of the path's suffix, by options of matplotlib's ``savefig``.

    Raises:
        OSError: The disk is full or not writable; matplotlib's own error would not name the file.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.removeprefix(".").lower() or "png", **options)
    write_whole(path, buffer.getvalue())


def require_space(path: Path) -> None:
    """Check that the disk of a file's folder is not nearly full.

    HDF5 cannot close a file that it has failed to write: it must end before that.

    Raises:
        OSError: It has less than `LEAST_FREE`.
    """
    if shutil.disk_usage(path.parent).free < LEAST_FREE:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def is_leftover(path: Path) -> bool:
    """Whether a file is a lock, or was left behind by a process that was killed within `write_whole`."""
    return path.name == LOCK or path.suffix == ".tmp"


def read_bounded(path: Path, most_bytes: int) -> bytes:
    """Read a file that others may have made; a larger one, or a device without an end, takes no memory.

    Raises:
        OSError: It cannot be read, or is larger.
    """
    with open(path, "rb") as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f"larger than {most_bytes:,} bytes", str(path))
    return content


@contextmanager
def exclusive_lock(folder: Path) -> Iterator[bool]:
    """Lock a folder until the end of the block; give False if another process holds the lock.

    The operating system releases the lock when a process ends for whatever reason; its empty file remains.

    Raises:
        OSError: The file system has no locks, or the folder is not writable.
    """
    with open(Path(folder) / LOCK, "w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        except OSError as error:  # such as NFS without its lock daemon
            remedy = "this file system has no locks; choose a folder on another, or mount it with locks"
            raise OSError(error.errno, f"{error.strerror}: {remedy}", str(folder)) from error
        yield True
