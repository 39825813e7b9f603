"""What a camera is, whatever stands behind it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from mskgrasp.geometry import Pose


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
        serial: Which camera took it.
    """

    colour: np.ndarray
    depth: np.ndarray
    intrinsics: np.ndarray
    T_base_camera: Pose
    timestamp_s: float
    serial: str


class Camera(ABC):
    """A calibrated depth camera. Construction neither connects nor captures; ``with`` does."""

    @abstractmethod
    def connect(self) -> None:
        """Opens the device.

        Raises:
            DriverMissing, NotConnected: No driver, or no such device.
        """

    @abstractmethod
    def close(self) -> None:
        """Releases the device; safe to call twice."""

    @abstractmethod
    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """Takes a fresh frame.

        Raises:
            NotConnected: Outside the camera's context.
            CaptureFailed: No complete and fresh frame came within ``timeout_s``.
        """

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
