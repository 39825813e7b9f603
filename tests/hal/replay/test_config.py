"""Tolerances of a replay: each for its own quantity, up to its value and no farther."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hal.errors import NotRecorded
from hal.replay.config import ReplayArmConfig, ReplayCellConfig, Tolerances
from hal.replay.playback import Playback
from hal.replay.reader import read_recording
from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import quat_about_z, quat_multiply

TOLERANCES = Tolerances(position=2e-3, rotation=0.02, joints=0.01, width=1e-3, other=0.5)


def off_by(arguments: dict[str, Any], name: str, by: float) -> dict[str, Any]:
    """The arguments of a command, one of them changed."""
    key = {"position": "T_base_tcp", "rotation": "T_base_tcp", "other": "force"}.get(name, name)
    value = np.array(arguments[key], dtype=float)
    if name == "position":
        value[:3] += by / np.sqrt(3)
    elif name == "rotation":
        value[3:] = quat_multiply(quat_about_z(np.array(by)), value[3:])
    elif name == "joints":
        value[4] += by
    else:
        value += by
    return {**arguments, key: value.tolist()}


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("position", "move_to_pose"),
        ("rotation", "move_to_pose"),
        ("joints", "move_to_joints"),
        ("width", "move_gripper"),
        ("other", "grasp"),
    ],
)
def test_each_quantity_has_its_own_tolerance(recording: Path, name: str, call: str):
    found = read_recording(recording)
    first = next(event for event in found.events if event.call == call)
    limit = getattr(TOLERANCES, name)
    for share, accepted in ((0.0, True), (0.95, True), (1.05, False)):
        playback = Playback(found, [call], TOLERANCES)
        playback.open()
        arguments = off_by(first.arguments, name, share * limit)
        if accepted:
            assert playback.command(call, arguments).call == call
        else:
            with pytest.raises(NotRecorded):
                playback.command(call, arguments)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"tolerances": {"position": -1e-3}},
            "'tolerances.position': input should be greater than",
        ),
        ({"tolerances": {"force": 1.0}}, "unknown key 'tolerances.force'; legal keys here: "),
        ({"recording": None}, "'recording'"),
    ],
)
def test_a_wrong_value_is_one_line_that_names_it(values: dict[str, Any], message: str):
    for kind, named in ((ReplayCellConfig, {"type": "replay"}), (ReplayArmConfig, {"driver": "replay"})):
        with pytest.raises(BadConfig) as caught:
            check_config(kind, {**named, "recording": "a.h5", **values}, "cell.yaml")
        assert message in str(caught.value) and "\n" not in str(caught.value)
