"""Freed memory that stays with the process."""

from __future__ import annotations

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of the parameters in glibc's malloc.h."""
_KEPT = 256 * 2**20
"""Most freed memory that is kept, bytes: a plan or a step of training needs a quarter of it."""
_LARGEST = 32 * 2**20
"""Larger pieces are mapped by the system, and returned to it, unless freed memory holds them; bytes."""


def keep_freed_memory() -> None:
    """Keep freed memory for the next tensors instead of returning it to the system; without glibc do nothing.

    A plan allocates some hundred tensors of a few MB. By default glibc returns their memory as soon as it
    is freed, and the kernel clears every page anew when it is used again: a sixth of a plan's time.
    """
    if sys.platform != "linux":
        return
    libc = ctypes.CDLL(None)
    if hasattr(libc, "gnu_get_libc_version"):  # musl's mallopt does not exist
        libc.mallopt(_TRIM_THRESHOLD, _KEPT)
        libc.mallopt(_MMAP_THRESHOLD, _LARGEST)
