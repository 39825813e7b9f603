"""STL, binary and text.

Our own reader: for intact files trimesh's gives the same triangles, but it accepts text that
is cut off, refuses text with CR line ends, with a facet on one line or with a solid
called ``vertex...``, and takes a binary file by its exact length alone.
"""

from __future__ import annotations

import re

import numpy as np

from mskgrasp.parts.importing.formats import MOST_TRIANGLES, Loaded, Unreadable
from mskgrasp.parts.importing.formats.float32 import check_resolution
from mskgrasp.parts.solids.surface import Surface

_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


def load_stl(content: bytes) -> Loaded:
    """Read an STL; its unit is unknown.

    Raises:
        Unreadable: It is other text, cut off, or too far from its origin.
    """
    size = len(content)
    claimed = int.from_bytes(content[80:_HEADER], "little") if size >= _HEADER else 0
    needed = _HEADER + claimed * _TRIANGLE.itemsize
    if size >= _HEADER and size == needed:
        return _binary(content, claimed, ())
    if b"\0" not in content[:_HEADER] and re.search(rb"(?i)\bfacet\b", content[:4096]):
        return _text(content)
    if size < _HEADER or b"\0" not in content[:4096]:
        raise Unreadable("is not an STL (text without facets?): export it again from the CAD program")
    if size < needed:
        raise Unreadable(
            f"is cut off: its header states {claimed:,} triangles, "
            f"the file ends after {(size - _HEADER) // _TRIANGLE.itemsize:,}; export or copy it again"
        )
    return _binary(content, claimed, (f"ignored {size - needed:,} bytes after the last triangle",))


def _binary(content: bytes, count: int, notes: tuple[str, ...]) -> Loaded:
    if count > MOST_TRIANGLES:
        raise Unreadable(f"has {count:,} triangles, the most is {MOST_TRIANGLES:,}: export it coarser")
    records = np.frombuffer(content, dtype=_TRIANGLE, count=count, offset=_HEADER)
    objects = (_soup(records["corners"].reshape(-1, 3).astype(np.float64)),)
    check_resolution(objects)
    return Loaded(objects=objects, notes=notes)


def _text(content: bytes) -> Loaded:
    rows = re.findall(rb"(?i)\bvertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", content)
    if not re.search(rb"(?i)\bendsolid\b", content[-4096:]) or len(rows) % 3:
        raise Unreadable(
            f"is cut off: no endsolid follows its {len(rows) // 3:,} triangles; export or copy it again"
        )
    return Loaded(objects=(_soup(np.array(rows, dtype="S").reshape(-1, 3).astype(np.float64)),))


def _soup(corners: np.ndarray) -> Surface:
    return Surface(vertices=corners, faces=np.arange(len(corners)).reshape(-1, 3))
