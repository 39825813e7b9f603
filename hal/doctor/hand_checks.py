"""Checks of a real cell's hand: as the robot is configured for it, and as it was measured."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hal.arm import WIDTH_TOLERANCE, Arm
from hal.cell import Workspace
from hal.doctor.checks import Finding
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.core.panda_body import HAND_CENTRE, HAND_MASS

_HAND_MASS_OK, _HAND_CENTRE_OK = 0.1, 0.02
"""Other fingers may change the hand's mass, kg, and centre of mass, metres, by this much."""


def check_hand(arm: Arm) -> Iterator[Finding]:
    """Whether the robot is configured for its hand, how far that opens, and which parts it carries.

    The end effector's frame is checked on connecting. Nothing where the arm does not report its hand.
    """
    hand = arm.hand()
    if hand is None:
        return
    off = abs(hand.mass - HAND_MASS)
    shift = float(np.linalg.norm(hand.centre_flange - HAND_CENTRE))
    said = f"Desk states {hand.mass:.2f} kg, centre at {np.round(hand.centre_flange, 3).tolist()} m"
    wrong = off > _HAND_MASS_OK or shift > _HAND_CENTRE_OK
    remedy = (
        f"; the Franka Hand has {HAND_MASS} kg at {list(HAND_CENTRE)} m: choose it in Desk, Settings, End "
        "Effector, or enter what changed fingers weigh: the arm sags or rises by the difference"
    )
    yield Finding(
        level="ok" if not wrong else "fail" if off > 3 * _HAND_MASS_OK else "warn",
        subject="hand",
        text=said + (remedy if wrong else ""),
    )
    if hand.load_mass > 0:
        yield Finding(
            level="warn",
            subject="load",
            text=f"the robot compensates {hand.load_mass:.3f} kg of an earlier program's part; the next "
            "program's first gripper command clears it: python -m hal.home does",
        )
    yield Finding(
        level="ok",
        subject="payload",
        text=f"parts up to {arm.limits.max_load:.2f} kg, by arm.contact_force and arm.contact_torque",
    )
    widest = arm.state().max_width
    if abs(widest - MAX_OPENING) > WIDTH_TOLERANCE:
        yield Finding(
            level="warn",
            subject="fingers",
            text=f"they open to {widest * 1e3:.1f} mm, and grasps are planned for {MAX_OPENING * 1e3:g} mm; "
            "if they were changed since the last homing run python -m hal.home",
        )


def check_grip(values: dict[str, Any], cell_file: Path, workspace: Workspace) -> Finding | None:
    """Whether force and speed of a real hand were measured for the force in use; None for other cells."""
    arm, table = values.get("arm"), values.get("workspace")
    if values.get("type") != "devices" or not isinstance(arm, dict) or not isinstance(table, dict):
        return None
    remedy = f"measure it: python -m hal.doctor --cell {cell_file} --gripper"
    measured = table.get("measured_grip")
    if measured is None:
        text = f"force and speed are not measured, simulation assumes its own; {remedy}"
        return Finding(level="warn", subject="grip", text=text)
    text = (
        f"{measured['finger_force']:g} N a pad at {1e3 * measured['finger_speed']:g} mm/s a finger, measured "
        f"for {measured['grasp_force']:g} N commanded"
    )
    if abs(measured["grasp_force"] - workspace.grasp_force) > 0.5:
        text += f"; workspace.grasp_force is {workspace.grasp_force:g} N: {remedy}"
        return Finding(level="warn", subject="grip", text=text)
    return Finding(level="ok", subject="grip", text=text)
