"""What a worker is asked to make, and what it makes it with; known without the simulator."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from dataclasses import dataclass
from functools import cache
from pathlib import Path

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


_PACKAGE = Path(mskgrasp.__file__).parent
_SIMULATES = (
    *sorted((_PACKAGE.parent / "tasks").glob("*.py")),
    *sorted((_PACKAGE / "settings").glob("*.py")),
    *(_PACKAGE / name for name in ("geometry.py", "grasp.py", "finding.py", "collect/shard.py")),
)
"""The code that decides what a shard holds."""


@cache
def simulation_digest() -> str:
    """Digest of that code: two commits of one version need not make the same data."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in _SIMULATES)).hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of what makes the data."""
    packages = ("sapien", "mani_skill", "torch", "numpy")
    found = {name: importlib.metadata.version(name) for name in packages}
    return dict(
        found,
        mskgrasp=mskgrasp.__version__,
        simulation=simulation_digest(),
        python=platform.python_version(),
    )


def other_versions(found: dict[str, str]) -> str:
    """How versions differ from those of this machine, in words; empty where they do not."""
    own = versions()
    return ", ".join(
        f"{name} {found.get(name, 'unknown')} (here {version})"
        for name, version in own.items()
        if found.get(name) != version
    )
