"""What a real cell does not do exactly: errors of arm, gripper, friction and camera, an attempt each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose

Range = tuple[float, float]


class ExecutionNoise(Config):
    """Distributions of the cell's errors; everything is off by default. SI units.

    Labels keep their meaning: the displacement is between what was commanded and seen, and where the part
    truly is in the hand, so that it holds what these errors do.
    """

    arm_position_std: float = Field(default=0.0, ge=0, le=0.005)
    """Error of the hand's place along each axis of the base, normal, m; a grasp below the lowest allowed
    one is lifted to it."""
    arm_angle_std: float = Field(default=0.0, ge=0, le=0.1)
    """Error of the hand's turn about the vertical, normal, rad."""
    finger_force: Range | None = None
    """Force of each pad, uniform between two bounds, N; null: that of the physics settings."""
    friction_pad_part: Range | None = None
    """Effective coefficient between pads and part, uniform between two bounds; null: that of the settings."""
    camera_position_std: float = Field(default=0.0, ge=0, le=0.02)
    """Error of the camera's calibrated place along each axis of the base, normal, m."""
    camera_angle_std: float = Field(default=0.0, ge=0, le=0.05)
    """Error of its turn about each axis of its optical frame, normal, rad; 0.01 moves the picture by 8 mm at
    0.8 m."""

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
        """Whether the camera hangs elsewhere than its calibration says."""
        return self.camera_position_std > 0 or self.camera_angle_std > 0

    def draw(self, rng: np.random.RandomState) -> ExecutionError:
        """The errors of one attempt.

        Every quantity is drawn whether it is on or not: switching one on leaves the others as they were.
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
    """What one attempt meets.

    Attributes:
        grasp: (4,) added to the commanded x, y, z, theta, base frame, m and rad.
        finger_force: Of each pad, N; None: that of the physics settings.
        friction_pad_part: Effective coefficient; None: that of the physics settings.
        camera_shift: (3,) of the camera's true place against its calibration, base frame, m.
        camera_turn: (3,) rotation vector of its true optical frame in the calibrated one, rad.
    """

    grasp: np.ndarray
    finger_force: float | None
    friction_pad_part: float | None
    camera_shift: np.ndarray
    camera_turn: np.ndarray

    def true_camera(self, calibrated: Pose) -> Pose:
        """Where the camera truly is, ``T_base_camera``, when its calibration says ``calibrated``."""
        angle = float(np.linalg.norm(self.camera_turn))
        axis = self.camera_turn / angle if angle else np.zeros(3)
        turn = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
        seen = calibrated @ Pose(position=np.zeros(3), quat_wxyz=turn)
        return Pose(position=seen.position + self.camera_shift, quat_wxyz=seen.quat_wxyz)


def _between(bounds: Range | None, share: float) -> float | None:
    return None if bounds is None else bounds[0] + share * (bounds[1] - bounds[0])
