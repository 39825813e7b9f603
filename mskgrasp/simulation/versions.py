"""Versions of the simulation and of the libraries that simulated data depend on."""

from __future__ import annotations

import importlib.metadata
import platform

from mskgrasp.core.version import __version__

SIMULATION_VERSION = 4
"""Raised by every change after which a seed makes other attempts; `tests/versions.py` names the files."""

_FIRST_SIMULATION = "38dc7f58aea7bdfa"
"""In place of the number in shards made by version 1 before versions were counted: a digest of its files."""


def versions() -> dict[str, str]:
    """Versions of the simulation and of the libraries that the data depend on."""
    packages = ("sapien", "mani_skill", "torch", "numpy")
    found = {name: importlib.metadata.version(name) for name in packages}
    return dict(
        found,
        mskgrasp=__version__,
        simulation=str(SIMULATION_VERSION),
        python=platform.python_version(),
    )


def other_versions(found: dict[str, str]) -> str:
    """Differences of versions from those of this machine, in words; empty where there are none."""
    own = versions()
    if found.get("simulation") == _FIRST_SIMULATION:
        found = found | {"simulation": "1"}
    return ", ".join(
        f"{name} {found.get(name, 'unknown')} (here {version})"
        for name, version in own.items()
        if found.get(name) != version
    )
