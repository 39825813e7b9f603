"""Files of named arrays (npz)."""

from __future__ import annotations

import io
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.core.files import write_whole

BAD_HEADER = (ValueError, TypeError, SyntaxError, tokenize.TokenError)
"""What numpy raises for an array whose header, a literal of Python, is cut off or holds something else."""


def write_arrays(path: Path, **arrays: Any) -> None:
    """Write arrays into one compressed file, atomically.

    Raises:
        OSError: The disk is full or not writable.
    """
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_whole(path, buffer.getvalue())


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read all arrays of a file; nothing in it is unpickled.

    Raises:
        OSError: It cannot be read.
        ValueError: It is damaged, or holds something else.
    """
    content = path.read_bytes()
    if not content.startswith(b"PK"):  # numpy would advise to read it as a pickle
        raise ValueError("it is no archive of arrays")
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except BAD_HEADER as error:
        raise ValueError("an array is cut off, or holds objects in place of numbers") from error
    except (LookupError, EOFError, OSError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        # RuntimeError: an unknown compression, or a changed bit that stands for encryption.
        raise ValueError(" ".join(str(error).split())) from error
    except MemoryError as error:  # of the size in an array's header, before anything of it is read
        raise ValueError(f"an array is larger than the memory: {error}") from error
