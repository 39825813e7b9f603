"""Files of cells that are not simulated: an arm and a camera, a recording, and the documented real cell."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.core.shipped import config_file

REAL = """\
type: devices
arm: {driver: franky, host: 127.0.0.1, robot: fr3}
camera: {driver: kinect2, calibration: a}
"""
"""No arm answers there; a workspace is missing."""
REPLAYED = """\
type: devices
arm: {driver: replay, recording: a.h5}
camera: {driver: replay, recording: a.h5}
workspace: {table_z: 0.0}
"""


def measured_cell(folder: Path) -> Path:
    """The documented real cell's file, in a folder, its table measured at the height of the base."""
    text = config_file("cells/panda_kinect2.yaml").read_text(encoding="utf-8")
    assert text.count("table_z: null") == 1
    path = folder / "measured.yaml"
    path.write_text(text.replace("table_z: null", "table_z: 0.0"), encoding="utf-8")
    return path
