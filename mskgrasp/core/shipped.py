"""Paths of the files that ship with the package: configurations, example parts, trained networks."""

from __future__ import annotations

from pathlib import Path

# In a checkout a link to configs/ beside the package: resolved, so that messages show the checkout's path.
_CONFIGS = (Path(__file__).parents[1] / "configs").resolve()
_EXAMPLES = Path(__file__).resolve().parents[1] / "examples"

PRETRAINED = Path(__file__).parents[1] / "learning" / "pretrained"
"""Folder of the networks that plan by default."""


def config_file(name: str) -> Path:
    """The path of a shipped configuration, for example ``cells/sapien.yaml``."""
    return _CONFIGS / name


SIMULATED_CELL = config_file("cells/sapien.yaml")
"""The cell by default."""


def example_file(name: str) -> Path | None:
    """The path of a shipped example part such as ``bracket.stl``; None if no example has that name."""
    path = _EXAMPLES / name
    return path if Path(name).name == name and path.is_file() else None


def is_example(path: Path) -> bool:
    """Whether a file is an example part that ships."""
    return path.resolve().parent == _EXAMPLES
