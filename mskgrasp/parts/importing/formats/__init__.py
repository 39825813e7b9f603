"""One module a file format: bytes in, triangles in the file's own unit out.

No reader opens another file, goes to the network, or runs anything that stands in the file.
"""

from __future__ import annotations

from dataclasses import dataclass

from mskgrasp.parts.solids.surface import Surface

MOST_TRIANGLES = 10_000_000
"""Of a whole file: some 5 GB of memory while it is mended."""


class Unreadable(Exception):
    """The content is no such file; the message goes on a sentence that begins with the file's name."""


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """What a file says.

    Attributes:
        objects: As the file keeps them apart, in the file's unit.
        unit: Its name, where the format or the file says it.
        unit_mm: Its length in millimetres.
        unit_by_convention: Only the format's standard says the unit, and many exporters do not heed it.
        told: What a user should know about the reading.
    """

    objects: tuple[Surface, ...]
    unit: str | None = None
    unit_mm: float = 1.0
    unit_by_convention: bool = False
    told: tuple[str, ...] = ()
