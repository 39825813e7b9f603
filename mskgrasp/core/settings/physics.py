"""Physics settings of the simulated cell.

The reason for a default is given with it; the measurements are in docs/results/physics_settings.md.
"""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.grasp import HOLD_S

LEAST_RATE_HZ = 250
MOST_ITERATIONS = 255
"""SAPIEN keeps the number in eight bits: 256 would be none."""


class Physics(Config):
    """Settings of the simulated cell; SI units."""

    rate_hz: int = Field(default=1000, ge=100)
    """Simulation steps a second; `validate` compares rates. Below 250 Hz light parts creep out of the
    fingers, and no data is collected."""
    coarse_rate_hz: int = Field(default=500, ge=100)
    """Steps a second, at most ``rate_hz``, during lift and hold, and while a part that is not held comes to
    rest; 500, stated or not, is lowered with ``rate_hz``. The first 6 mm of the lift, in which the part
    leaves the table, and the last 20 ms before the part's pose in the hand is measured use ``rate_hz``, as
    does the simulated cell (`hal.sim`) unless nothing can touch its hand. At 250 Hz parts swing in the hand,
    by up to 13 degrees more than at 1000 Hz."""
    position_iterations: int = Field(default=50, ge=4, le=MOST_ITERATIONS)
    """Solver iterations a step; `validate` compares them."""
    hold_iterations: int = Field(default=50, ge=4, le=MOST_ITERATIONS)
    """The same, if more, while a part is lifted and held: with fewer, some parts swing in the hand that
    friction holds, such as a bolt that hangs from one point of each pad; finer steps change nothing."""
    contact_offset: float = Field(default=0.001, gt=0, le=0.02)
    """Margin around each shape, m: contacts are made where two margins meet. A larger one costs time."""
    persistent_manifold: bool = False
    """PhysX' cache of contact points (PCM); on a GPU it is always on. Stale points keep some blocks that spin
    between closing pads rotated."""
    friction_pad_part: float = Field(default=0.5, ge=0, le=2)
    """Effective Coulomb coefficient between pads and part (rubber on dry steel: 0.4 to 0.7)."""
    friction_table_part: float = Field(default=0.4, ge=0, le=2)
    """Effective Coulomb coefficient between table and part."""
    pad_patch_radius: float = Field(default=0.005, ge=0)
    """Lever with which friction at a single contact point of a pad resists turning, m: mu F r, as a disc of
    1.5 times this radius under uniform pressure. Contacts of more points do not depend on it."""
    finger_speed: float = Field(default=0.05, gt=0)
    """Closing speed of each finger, m/s (Franka Hand, product data sheet: at most 50 mm/s a finger; the speed
    that libfranka takes is that of the width, twice as much)."""
    finger_force: float = Field(default=30.0, gt=0, le=70)
    """Force of each pad on the part, N. The Franka Hand presses with at most 70 N continuously (data sheet)
    and, by its maker, with no less than 30 N (libfranka issue 111)."""
    finger_stiffness: float = Field(default=8000.0, gt=0)
    """Drive stiffness of a finger, N/m; with the force limit and the speed it decides how soon a stopped pad
    reaches its full force. The hand's own value is not published. With 16 kN/m pads on a thin sheet
    begin to oscillate in steps of 4 ms, up to many times the force limit."""
    finger_damping: float = Field(default=100.0, ge=0)
    """Drive damping of a finger, N s/m: critical, with the armature."""
    finger_armature: float = Field(default=0.3, ge=0)
    """Inertia of motor and drive that a finger joint carries, kg. It is not published; `validate` shows what
    other values change."""
    descend_speed: float = Field(default=0.25, gt=0)
    """Peak speed of the straight descent, m/s."""
    lift_speed: float = Field(default=0.25, gt=0)
    """Peak speed of the straight lift, m/s."""
    lift_height: float = Field(default=0.1, gt=0, le=0.3)
    """Height by which a part is lifted, m."""
    hold_s: float = Field(default=HOLD_S, ge=HOLD_S)
    """Time for which the lifted part is held before it is judged, s."""
    settle_s: float = Field(default=0.02, ge=0)
    """Time in which a part may settle on the table before it is grasped, s; it starts in a pose in which the
    engine has held it at rest."""
    approach_clearance: float = Field(default=0.01, gt=0, le=0.1)
    """Height of the pads over the part's top at which the straight descent begins, m."""
    skip_air: bool = True
    """Whether motions of the hand through free space are skipped: it is placed at their end."""
    reflex_force: float = Field(default=20.0, gt=0)
    """Mean contact force on the hand over 24 ms that ends a motion, N, as the robot's reflex would."""

    @model_validator(mode="before")
    @classmethod
    def _coarse_rate_follows(cls, values: Any) -> Any:
        # rate_hz may be lowered alone. The default counts as not stated: a command line states every value.
        usual = cls.model_fields["coarse_rate_hz"].default
        if isinstance(values, dict) and values.get("coarse_rate_hz", usual) == usual:
            rate = values.get("rate_hz")
            if isinstance(rate, int | float) and rate < usual:
                return values | {"coarse_rate_hz": rate}
        return values

    @model_validator(mode="after")
    def _check(self) -> Physics:
        if self.coarse_rate_hz > self.rate_hz:
            raise ValueError(
                f"coarse_rate_hz is at most rate_hz, {self.rate_hz}, got {self.coarse_rate_hz}: lower it, too"
            )
        return self
