"""franky-sim for less processor time: meshes that are only looked at left out, messages packed in one go."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from franky_sim.franka_robot_state import FrankaRobotState
from franky_sim.mujoco_simulator import MujocoSimulator

_FIELDS = (
    *("O_T_EE", "O_T_EE_d", "F_T_EE", "EE_T_K", "F_T_NE", "NE_T_EE", "m_ee", "I_ee", "F_x_Cee"),
    *("m_load", "I_load", "F_x_Cload", "elbow", "elbow_d", "tau_J", "tau_J_d", "dtau_J"),
    *("q", "q_d", "dq", "dq_d", "ddq_d"),
    *("joint_contact", "cartesian_contact", "joint_collision", "cartesian_collision"),
    *("tau_ext_hat_filtered", "O_F_ext_hat_K", "K_F_ext_hat_K", "O_dP_EE_d", "O_ddP_O"),
    *("elbow_c", "delbow_c", "ddelbow_c", "O_T_EE_c", "O_dP_EE_c", "O_ddP_EE_c"),
    *("theta", "dtheta", "accelerometer_top", "accelerometer_bottom"),
)
_MESSAGE = struct.Struct("<320f 2B 41? 41? B f")


def replace(state: FrankaRobotState, **values: Any) -> FrankaRobotState:
    """`FrankaRobotState.replace` without going through all fields."""
    other = object.__new__(FrankaRobotState)
    vars(other).update(vars(state), **values)
    return other


def pack_state(state: FrankaRobotState) -> bytes:
    """`FrankaRobotState.pack_state` by one structure."""
    numbers: list[float] = []
    for name in _FIELDS:
        value = getattr(state, name)
        numbers += (value,) if isinstance(value, float) else value
    return _MESSAGE.pack(
        *numbers, state.motion_generator_mode, state.controller_mode, *state.errors, *state.reflex_reason,
        state.robot_mode, state.control_command_success_rate,
    )  # fmt: skip


class QuickSimulator(MujocoSimulator):
    """franky-sim's simulation without the meshes that are only looked at."""

    def _start(self) -> None:
        for body in self.scene.iter("body"):
            for geom in body.findall("geom[@class='visual']"):
                body.remove(geom)
        used = {geom.get("mesh") for geom in self.scene.iter("geom")}
        for asset in self.scene.iter("asset"):
            for mesh in asset.findall("mesh"):
                if mesh.get("name", Path(mesh.get("file", "")).stem) not in used:
                    asset.remove(mesh)
        super()._start()
