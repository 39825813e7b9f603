"""Cells whose tables are known: a toy arm over a plane, and simulated cells with an error of their table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from hal import ArmLimits, Cell
from hal.gripper import FRANKA_HAND
from hal.limits import plane_height
from mskgrasp.core.geometry import Pose
from tests.hal.replay.toy import ToyArm, toy_cell

CELLS = Path(__file__).parents[3] / "configs" / "cells"
REGION = (0.38, 0.62, -0.12, 0.12)


class FeelingArm(ToyArm):
    """A toy arm that stops at a table, keeps the places at which it did, and moves no fingers there."""

    def __init__(self, height: Callable[[np.ndarray], float], limits: ArmLimits) -> None:
        super().__init__()
        self.limits = limits
        self._height = height
        self.forces: list[float] = []
        self.speeds: list[float] = []

    @property
    def reach(self) -> float:
        """Reach of the pads beyond the TCP, metres."""
        return self.limits.gripper.pad_reach

    def _move_to_pose(self, T_base_tcp: Pose, speed: float) -> None:
        position = T_base_tcp.position
        assert position[2] - self.reach > self._height(position[:2]), "pressed into the table"
        self._joints = np.concatenate([position, np.zeros(4)])
        self._quat_wxyz = T_base_tcp.quat_wxyz

    def _move_gripper(self, width: float) -> None:
        position = self._joints[:3]
        assert position[2] - self.reach > self._height(position[:2]), "fingers moved on the table"
        super()._move_gripper(width)

    def _move_until_contact(self, T_base_tcp: Pose, force: float, speed: float) -> Pose | None:
        position = np.array(T_base_tcp.position)
        touched = self._height(position[:2]) + self.reach
        met = touched > position[2]
        position[2] = max(position[2], touched)
        self._joints, self._quat_wxyz = np.concatenate([position, np.zeros(4)]), T_base_tcp.quat_wxyz
        self.forces.append(force)
        self.speeds.append(speed)
        return Pose(position=position, quat_wxyz=T_base_tcp.quat_wxyz) if met else None


def feeling_cell(
    height: Callable[[np.ndarray], float],
    *,
    table_z: float = 0.0,
    table_slope: tuple[float, float] = (0.0, 0.0),
    clearance: float = 0.003,
    pad_reach: float = FRANKA_HAND.pad_reach,
) -> Cell:
    """A cell with a `FeelingArm` over a table of a height at points (2,), stated at ``table_z``."""
    cell = toy_cell()
    ones = np.ones(7)
    limits = ArmLimits(
        joint_lower=-ones,
        joint_upper=ones,
        box_lower=np.array([0.2, -0.4, table_z]),
        box_upper=np.array([0.8, 0.4, 0.8]),
        table_z=table_z,
        max_force=70.0,
        clearance=clearance,
        table_slope=np.array(table_slope),
        table_centre=np.array([0.5, 0.0]),
        gripper=replace(FRANKA_HAND, pad_reach=pad_reach),
    )
    workspace = replace(
        cell.workspace,
        table_z=table_z,
        table_slope=table_slope,
        clearance=clearance,
        region=REGION,
        home=np.array([0.4, 0.0, 0.5, 0, 0, 0, 0]),
    )
    return replace(cell, arm=FeelingArm(height, limits), workspace=workspace, tracker=None)


def tilted(z: float, slope: tuple[float, float]) -> Callable[[np.ndarray], float]:
    """Height at points (2,) of a plane through the middle of the region."""
    return lambda xy: float(plane_height(xy, z, slope, (0.5, 0.0)))


def simulated_file(folder: Path, kind: str, **table_error: object) -> Path:
    """File of a simulated cell with an error of its table."""
    values = yaml.safe_load((CELLS / f"{kind}.yaml").read_text())
    path = folder / f"{kind}.yaml"
    path.write_text(yaml.safe_dump({**values, "table_error": table_error}))
    return path
