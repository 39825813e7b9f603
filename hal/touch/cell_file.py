"""The table in the text of a cell's file, of which all else stays as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from mskgrasp.core.errors import BadConfig
from mskgrasp.core.files import write_whole

_DIGITS = 5


def with_table(text: str, z: float, slope: tuple[float, float] | None) -> str:
    """Text of a cell's file with another ``workspace.table_z``; comments and order stay.

    Args:
        text: Its YAML.
        z: Height of the table, metres; written to a hundredth of a millimetre.
        slope: Rise along x and along y, metres a metre; None for a level table, which needs no line.

    Raises:
        BadConfig: The file has no ``workspace.table_z`` that can be replaced.
    """
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    workspace = _value(root, "workspace")
    height, tilt = _value(workspace, "table_z"), _value(workspace, "table_slope")
    if height is None:
        raise BadConfig("the file has no workspace.table_z; write 'table_z: null' there")
    x, y = slope or (0.0, 0.0)
    rounded = f"[{_number(x)}, {_number(y)}]"
    new = _number(z)
    edits: list[tuple[int, int, str]] = []
    if tilt is not None:
        edits.append((tilt.start_mark.index, tilt.end_mark.index, rounded))
    elif slope is not None and workspace.flow_style:
        new = f"{new}, table_slope: {rounded}"
    elif slope is not None:
        end = text.find("\n", height.end_mark.index)
        key = next(key for key, _ in workspace.value if key.value == "table_z")
        line = f"\n{' ' * key.start_mark.column}table_slope: {rounded}"
        edits.append((end, end, line) if end >= 0 else (len(text), len(text), line))
    begin, end = height.start_mark.index, height.end_mark.index
    edits.append((begin, end, new if begin < end else f" {new}"))
    for begin, end, piece in sorted(edits, reverse=True):
        text = text[:begin] + piece + text[end:]
    return text


def write_table(path: Path, z: float, slope: tuple[float, float] | None) -> None:
    """Write a table's height, and its slope unless it is level, into a cell's file, atomically.

    Raises:
        BadConfig: The file cannot be rewritten; it is as before.
    """
    path = path.resolve()  # a link stays a link
    text = path.read_text(encoding="utf-8")
    new = with_table(text, z, slope)
    before, after = yaml.safe_load(text), yaml.safe_load(new)
    for values in (before, after):
        for key in ("table_z", "table_slope"):
            values["workspace"].pop(key, None)
    if before != after:
        raise BadConfig(f"{path}: the text cannot be edited; write table_z {z:.5f} there by hand")
    write_whole(path, new.encode())


def _number(value: float) -> str:
    """A number without an exponent: YAML 1.1 takes 1e-05 for text."""
    text = f"{value:.{_DIGITS}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text


def _value(mapping: Any, name: str) -> Any:
    """Node of a key of a mapping's node; None without one."""
    if not isinstance(mapping, yaml.MappingNode):
        return None
    return next((value for key, value in mapping.value if key.value == name), None)
