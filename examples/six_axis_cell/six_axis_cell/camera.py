"""Camera of any device that gives depth, intrinsics and a pose."""

from __future__ import annotations

import time
from typing import Protocol

import numpy as np

from hal import Camera, RgbdFrame
from hal.errors import CaptureFailed, NotConnected
from mskgrasp import Pose


class DepthDevice(Protocol):
    """What a vendor's driver offers."""

    serial: str
    intrinsics: np.ndarray
    """(3, 3) pixels."""

    def open(self) -> None: ...
    def close(self) -> None: ...
    def read(self, timeout_s: float) -> np.ndarray | None:
        """Depth (h, w) in metres, 0 where invalid; None if no new image came in time."""
        ...


class DepthCamera(Camera):
    """The device as a `hal.Camera`; colour is grey, made of depth, where the device has none."""

    def __init__(self, device: DepthDevice, T_base_camera: Pose):
        self._device, self._pose, self._open = device, T_base_camera, False

    def connect(self) -> None:
        if not self._open:
            self._device.open()
            self._open = True

    def close(self) -> None:
        if self._open:
            self._open = False
            self._device.close()

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        if not self._open:
            raise NotConnected("the depth device is not connected; use it inside its context (with ...)")
        exposed_s = time.monotonic()
        depth = self._device.read(timeout_s)
        if depth is None:
            raise CaptureFailed(f"no image within {timeout_s:g} s; check the camera's cable")
        grey = np.clip(depth * 100, 0, 255).astype(np.uint8)
        return RgbdFrame(
            colour=np.stack([grey] * 3, axis=-1),
            depth=np.where(depth > 0, depth, np.nan).astype(np.float32),
            intrinsics=self._device.intrinsics.copy(),
            T_base_camera=Pose(position=self._pose.position.copy(), quat_wxyz=self._pose.quat_wxyz.copy()),
            timestamp_s=exposed_s,
            serial=self._device.serial,
        )


class FlatTable:
    """Device of the example: it sees a block of 60 x 30 x 40 mm on a flat table, from a height in metres."""

    serial = "flat-table-1"
    intrinsics = np.array([[365.0, 0.0, 79.5], [0.0, 365.0, 79.5], [0.0, 0.0, 1.0]])

    def __init__(self, height: float):
        self._height = height

    def open(self) -> None: ...
    def close(self) -> None: ...

    def read(self, timeout_s: float) -> np.ndarray:
        depth = np.full((160, 160), self._height)
        depth[70:84, 66:94] -= 0.04
        depth[0, 0] = 0.0  # as devices mark what they do not see
        return depth
