"""Industrial parts with a mesh, collision hulls, mass, inertia and stable poses."""

from __future__ import annotations

from mskgrasp.parts.builtin import build_part, builtin_names, find_part, starter_names
from mskgrasp.parts.catalogue import chosen_names
from mskgrasp.parts.load import load_part
from mskgrasp.parts.part import Part
from mskgrasp.parts.store import parts_folder, read_part

__all__ = [
    "Part",
    "build_part",
    "builtin_names",
    "chosen_names",
    "find_part",
    "load_part",
    "parts_folder",
    "read_part",
    "starter_names",
]
