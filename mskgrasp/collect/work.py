"""What a worker is asked to make, and what it makes it with; known without the simulator."""

from __future__ import annotations

import importlib.metadata
import platform
from dataclasses import dataclass

import mskgrasp


@dataclass(frozen=True, kw_only=True)
class ShardTask:
    """Which attempts to make: `n` of them on a part, from number `first` on."""

    part: str
    folder: str
    index: int
    first: int
    n: int
    seed: int


def versions() -> dict[str, str]:
    """Versions of what makes the data."""
    packages = ("sapien", "mani_skill", "torch", "numpy")
    found = {name: importlib.metadata.version(name) for name in packages}
    return dict(found, mskgrasp=mskgrasp.__version__, python=platform.python_version())
