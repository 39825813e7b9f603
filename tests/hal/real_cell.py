"""The documented real cell once its table has been measured."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.core.shipped import config_file


def measured_cell(folder: Path) -> Path:
    """Its file, in a folder, with a table at the height of the base."""
    text = config_file("cells/panda_kinect2.yaml").read_text(encoding="utf-8")
    assert text.count("table_z: null") == 1
    path = folder / "measured.yaml"
    path.write_text(text.replace("table_z: null", "table_z: 0.0"), encoding="utf-8")
    return path
