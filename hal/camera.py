"""Abstract depth camera."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from hal.device import Device
from mskgrasp.core.geometry import Pose


@dataclass(frozen=True, kw_only=True)
class RgbdFrame:
    """One exposure: colour registered to depth.

    Attributes:
        colour: (h, w, 3) uint8, RGB.
        depth: (h, w) float32, metres along the optical axis, NaN where invalid.
        intrinsics: (3, 3) pinhole matrix in pixels; pixel (u, v) = (column, row), its centre at
            integer coordinates.
        T_base_camera: Pose of the camera's optical frame (x right, y down, z forward) in the base.
        timestamp_s: Time of the exposure, seconds on the monotonic clock of this machine.
        serial: Serial number of the camera.
        fine_colour: (k h, k w, 3) uint8, RGB, or None: the same exposure with k x k pixels of colour for
            every pixel of depth, if the camera provides them and its settings request them.
        infrared: (h, w) uint16, linear in the light, or None: the same exposure in infrared, if the camera
            provides it. It shares its optics with depth, so that nothing needs to be registered.
    """

    colour: np.ndarray
    depth: np.ndarray
    intrinsics: np.ndarray
    T_base_camera: Pose
    timestamp_s: float
    serial: str
    fine_colour: np.ndarray | None = None
    infrared: np.ndarray | None = None


class Camera(Device):
    """A calibrated depth camera. Construction neither connects nor captures; ``with`` does."""

    rendered: bool = False
    """Whether frames come from SAPIEN's renderer, which `hal.doctor` then checks."""

    @property
    def exposures(self) -> int:
        """Exposures of a frame; with several, depth is their median and the timestamp that of the first."""
        return 1

    @property
    def by_hand(self) -> bool:
        """Whether its pose was measured by hand, good to centimetres: `execute_grasp` then refuses."""
        return False

    @property
    def T_base_camera(self) -> Pose | None:
        """Pose of the optical frame as far as it is known before a frame: its body is a keep-out there."""
        return None

    @abstractmethod
    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """Take a fresh frame.

        Raises:
            NotConnected: Outside the camera's context.
            CaptureFailed: No complete and fresh frame came within ``timeout_s``.
        """
