"""Industrial parts with a mesh, collision hulls, mass, inertia and stable poses."""

from __future__ import annotations

from mskgrasp.parts.build import build_part, builtin_names, find_part, starter_names
from mskgrasp.parts.catalogue import chosen_names
from mskgrasp.parts.part import Part
from mskgrasp.parts.store import load_part, parts_folder

__all__ = [
    "Part",
    "build_part",
    "builtin_names",
    "chosen_names",
    "find_part",
    "load_part",
    "parts_folder",
    "starter_names",
]
