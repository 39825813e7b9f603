"""Readers of file formats, one module each, from bytes to triangles in the file's own unit.

No reader opens another file, uses the network, or executes content of the file.
"""

from __future__ import annotations

from dataclasses import dataclass

from mskgrasp.parts.solids.surface import Surface

MOST_TRIANGLES = 10_000_000
"""Greatest number in a whole file: repairing it takes about 5 GB of memory."""


class Unreadable(Exception):
    """Content that cannot be read; the message continues a sentence that begins with the file's name."""


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """Content of a file in its own unit.

    Attributes:
        objects: As separated in the file.
        unit: Name of the unit, where the format or the file states it.
        unit_mm: Its length in millimetres.
        unit_by_convention: Only the format's standard states the unit, and many exporters ignore it.
        notes: Remarks for the user.
    """

    objects: tuple[Surface, ...]
    unit: str | None = None
    unit_mm: float = 1.0
    unit_by_convention: bool = False
    notes: tuple[str, ...] = ()
