"""Configuration of the MuJoCo cell and of its physics; importing it does not load the simulator."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from hal.config import SimulatedCellConfig
from mskgrasp.core.config import Config
from mskgrasp.core.settings import Physics

_COMMON = Physics()
"""Quantities of the real cell have the same defaults in every simulated one."""


class MujocoPhysics(Config):
    """Settings of the MuJoCo cell's physics; SI units."""

    step_s: float = Field(default=0.001, gt=0, le=0.0015)
    """Duration of a simulation step, s; MuJoCo softens contacts to a time constant of two steps at least."""
    contact_time_s: float = Field(default=0.003, gt=0, le=0.02)
    """Time constant of contacts (``solref``), s. With MuJoCo's 20 ms a pad sinks 1 mm into a part."""
    contact_impedance: tuple[float, float, float] = (0.1, 0.999, 0.00003)
    """Impedance of contacts at no penetration and when deep, and the width between, m (``solimp``). Contacts
    that stiffen sooner chatter: with 0.3 and 10 um a pad is off the part that it pushes for two fifths of the
    time, and the part slides along it where it should stick, by 0.5 mm in 9 mm (tests.benchmarks.pushing).
    With 100 um parts that stand on a narrow face sink in and lean."""
    solver_iterations: int = Field(default=50, ge=10)
    """Greatest number of Newton iterations a step."""
    noslip_iterations: int = Field(default=10, ge=0)
    """Iterations that remove the slow slip of soft friction; without them held parts creep."""
    collision: Literal["hulls", "sdf"] = "hulls"
    """hulls: the part's convex pieces. sdf: the signed distance field of its mesh, bores and all; slower."""
    friction_pad_part: float = Field(default=_COMMON.friction_pad_part, ge=0, le=2)
    """Coulomb coefficient between pads and part."""
    friction_table_part: float = Field(default=_COMMON.friction_table_part, ge=0, le=2)
    """Coulomb coefficient between table and part."""
    pad_patch_radius: float = Field(default=_COMMON.pad_patch_radius, ge=0)
    """Radius of the pad's contact patch, m, which resists turning about a single contact point. Contacts of
    more points do not depend on it, as in the SAPIEN cell."""
    pad_pieces: int = Field(default=2, ge=1, le=4)
    """Pieces of a pad along each edge. Contacts are at the corners of pieces: on a flat face one piece holds
    1.85 times the moment that evenly spread pressure does, 2 x 2 or 3 x 3 hold 1.15 times as much."""
    finger_speed: float = Field(default=_COMMON.finger_speed, gt=0)
    """Closing speed of each finger, m/s."""
    finger_armature: float = Field(default=_COMMON.finger_armature, ge=0)
    """Inertia of motor and spindle that a finger carries, kg."""
    reflex_force: float = Field(default=_COMMON.reflex_force, gt=0)
    """Mean contact force on the hand over 24 ms that ends a motion, N, as the robot's reflex would."""

    @model_validator(mode="after")
    def _check(self) -> MujocoPhysics:
        if self.contact_time_s < 2 * self.step_s:
            raise ValueError(
                f"contact_time_s {self.contact_time_s:g} must be at least two steps of {self.step_s:g} s"
            )
        low, high, width = self.contact_impedance
        if not (0 < low <= high < 1 and width > 0):
            raise ValueError(
                f"contact_impedance must be 0 < low <= high < 1 and a width > 0, "
                f"got {list(self.contact_impedance)}"
            )
        return self


class MujocoCellConfig(SimulatedCellConfig):
    """Settings of the cell simulated in MuJoCo."""

    type: Literal["mujoco"]
    physics: MujocoPhysics = MujocoPhysics()
    """Settings of the physics."""
