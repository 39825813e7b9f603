"""Execution noise: random errors of arm, gripper, friction and camera, drawn for each attempt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose

Range = tuple[float, float]


class ExecutionNoise(Config):
    """Distributions of the cell's errors; everything is off by default. SI units.

    Labels keep their definition: the displacement is from the commanded and observed pose to the true pose
    of the part in the hand, so that it includes the effect of these errors.
    """

    arm_position_std: float = Field(default=0.0, ge=0, le=0.005)
    """Standard deviation (normal) of the hand's position along each axis of the base, m; a grasp below the
    lowest allowed one is raised to it."""
    arm_angle_std: float = Field(default=0.0, ge=0, le=0.1)
    """Standard deviation (normal) of the hand's angle about the vertical, rad."""
    finger_force: Range | None = None
    """Bounds of each pad's force, uniformly distributed, N; null: the force in the physics settings."""
    friction_pad_part: Range | None = None
    """Bounds of the effective friction between pads and part, uniformly distributed; null: the settings'."""
    camera_position_std: float = Field(default=0.0, ge=0, le=0.02)
    """Standard deviation (normal) of the camera's calibrated position along each axis of the base, m."""
    camera_angle_std: float = Field(default=0.0, ge=0, le=0.05)
    """Standard deviation (normal) of its rotation about each axis of its optical frame, rad; 0.01 shifts the
    image by 8 mm at 0.8 m."""

    @model_validator(mode="after")
    def _check(self) -> ExecutionNoise:
        for name, least, most in (("finger_force", 0.0, 70.0), ("friction_pad_part", 0.0, 2.0)):
            bounds = getattr(self, name)
            if bounds is not None and not (least < bounds[0] <= bounds[1] <= most):
                raise ValueError(
                    f"{name} must be [low, high] with {least:g} < low <= high <= {most:g}, got {list(bounds)}"
                )
        return self

    @property
    def moves_camera(self) -> bool:
        """Whether the camera's true pose differs from its calibrated pose."""
        return self.camera_position_std > 0 or self.camera_angle_std > 0

    def draw(self, rng: np.random.RandomState) -> ExecutionError:
        """Draw the errors of one attempt.

        Every quantity is drawn whether it is on or off, so that switching one on leaves the others unchanged.
        """
        place, turn = rng.normal(size=3), rng.normal()
        force, friction = rng.uniform(size=2)
        camera_place, camera_turn = rng.normal(size=3), rng.normal(size=3)
        return ExecutionError(
            grasp=np.array([*(self.arm_position_std * place), self.arm_angle_std * turn]),
            finger_force=_between(self.finger_force, force),
            friction_pad_part=_between(self.friction_pad_part, friction),
            camera_shift=self.camera_position_std * camera_place,
            camera_turn=self.camera_angle_std * camera_turn,
        )


@dataclass(frozen=True, kw_only=True)
class ExecutionError:
    """The errors of one attempt.

    Attributes:
        grasp: (4,) error added to the commanded x, y, z, theta, base frame, m and rad.
        finger_force: Force of each pad, N; None: the force in the physics settings.
        friction_pad_part: Effective coefficient; None: the coefficient in the physics settings.
        camera_shift: (3,) true minus calibrated position of the camera, base frame, m.
        camera_turn: (3,) rotation vector of its true optical frame in the calibrated one, rad.
    """

    grasp: np.ndarray
    finger_force: float | None
    friction_pad_part: float | None
    camera_shift: np.ndarray
    camera_turn: np.ndarray

    def true_camera(self, calibrated: Pose) -> Pose:
        """The camera's true ``T_base_camera`` for its calibrated one."""
        angle = float(np.linalg.norm(self.camera_turn))
        axis = self.camera_turn / angle if angle else np.zeros(3)
        turn = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
        seen = calibrated @ Pose(position=np.zeros(3), quat_wxyz=turn)
        return Pose(position=seen.position + self.camera_shift, quat_wxyz=seen.quat_wxyz)


def _between(bounds: Range | None, share: float) -> float | None:
    return None if bounds is None else bounds[0] + share * (bounds[1] - bounds[0])
