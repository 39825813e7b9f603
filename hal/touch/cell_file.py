"""The table in the text of a cell's file, of which all else stays as it is."""

from __future__ import annotations

from pathlib import Path

import yaml

from hal.cell_file import number, with_values, write_values


def with_table(text: str, z: float, slope: tuple[float, float] | None) -> str:
    """Text of a cell's file with another ``workspace.table_z``; comments and order stay.

    Args:
        text: Its YAML.
        z: Height of the table, metres; written to a hundredth of a millimetre.
        slope: Rise along x and along y, metres a metre; None for a level table, which needs no line.

    Raises:
        BadConfig: The file has no ``workspace.table_z`` that can be replaced.
    """
    return with_values(text, "workspace", _values(text, z, slope), after="table_z")


def write_table(path: Path, z: float, slope: tuple[float, float] | None) -> None:
    """Write a table's height, and its slope unless it is level, into a cell's file, atomically.

    Raises:
        BadConfig: The file cannot be rewritten; it is as before.
    """
    values = _values(path.read_text(encoding="utf-8"), z, slope)
    write_values(path, "workspace", values, after="table_z")


def _values(text: str, z: float, slope: tuple[float, float] | None) -> dict[str, str]:
    """Values to write, as YAML; a slope that the file states is replaced also by a level table."""
    root = yaml.safe_load(text)
    workspace = root.get("workspace") if isinstance(root, dict) else None
    stated = isinstance(workspace, dict) and "table_slope" in workspace
    x, y = slope or (0.0, 0.0)
    sloping = {"table_slope": f"[{number(x)}, {number(y)}]"} if slope is not None or stated else {}
    return {"table_z": number(z)} | sloping
