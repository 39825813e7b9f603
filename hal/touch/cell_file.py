"""The table in the text of a cell's file, of which all else stays as it is."""

from __future__ import annotations

from pathlib import Path

import yaml

from hal.cell_file import number, require_writable, write_values

_SECTION, _KEY = "workspace", "table_z"


def require_table_writable(path: Path) -> None:
    """Refuse a cell's file into which no table can be written, before anything moves.

    Raises:
        UsageError: The file or its folder is not writable.
        BadConfig: It has no ``workspace.table_z`` that can be replaced.
    """
    require_writable(path, "the table", _SECTION, table_values("", 0.0, (0.0, 0.0)), after=_KEY)


def write_table(path: Path, z: float, slope: tuple[float, float] | None) -> None:
    """Write a table's height, and its slope unless it is level, into a cell's file, atomically.

    Args:
        path: The file.
        z: Height of the table, metres; written to a hundredth of a millimetre.
        slope: Rise along x and along y, metres a metre; None for a level table, which needs no line.

    Raises:
        BadConfig: The file cannot be rewritten; it is as before.
    """
    values = table_values(path.read_text(encoding="utf-8"), z, slope)
    write_values(path, _SECTION, values, after=_KEY)


def table_values(text: str, z: float, slope: tuple[float, float] | None) -> dict[str, str]:
    """Values to write into a file's text, as YAML; a level table, too, replaces a slope that it states."""
    root = yaml.safe_load(text)
    workspace = root.get(_SECTION) if isinstance(root, dict) else None
    stated = isinstance(workspace, dict) and "table_slope" in workspace
    x, y = slope or (0.0, 0.0)
    sloping = {"table_slope": f"[{number(x)}, {number(y)}]"} if slope is not None or stated else {}
    return {_KEY: number(z)} | sloping
