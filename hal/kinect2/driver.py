"""Driver of a Kinect v2 on pylibfreenect2: opens the camera without crashing and returns fresh frames."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
import time
import types
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from hal.errors import CaptureFailed, CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected
from hal.kinect2.clock import TICK_S, ExposureClock
from hal.kinect2.config import Pipeline
from hal.kinect2.images import HEIGHT, WIDTH

_NAMES = {
    "CpuPacketPipeline", "Frame", "FrameType", "Freenect2", "Registration", "SyncMultiFrameListener",
}  # fmt: skip
_SLICE_S = 0.2
"""Longest wait of one call into the vendor's driver, s."""


@dataclass(frozen=True, kw_only=True)
class Kinect2Settings:
    """Settings sent to the driver's process.

    Attributes:
        serial: Serial number; None for the only camera.
        pipeline: Decoder of depth.
        latency_s: Greatest delay from exposure to arrival, s.
        max_skew_s: Greatest time between the exposures of colour and depth, s.
        timeout_s: Time the camera has from opening to its first frame, s.
    """

    serial: str | None
    pipeline: Pipeline
    latency_s: float
    max_skew_s: float
    timeout_s: float


@dataclass(frozen=True, kw_only=True)
class RawFrame:
    """Copies of the images that libfreenect2 delivered, mirrored.

    Attributes:
        depth_mm: (424, 512) float32, undistorted.
        colour_bgrx: (424, 512, 4) uint8, registered to depth.
        exposed_s: Earliest time of the exposure, monotonic clock, s.
    """

    depth_mm: np.ndarray
    colour_bgrx: np.ndarray
    exposed_s: float


class Kinect2Driver:
    """An open, streaming Kinect v2.

    Args:
        settings: Serial number of the camera, and bounds of a valid frame.

    Raises:
        DriverMissing: pylibfreenect2 cannot be imported.
        NotConnected: No such camera, or it does not stream.
    """

    def __init__(self, settings: Kinect2Settings):
        self._settings = settings
        self._vendor = import_vendor()
        self._clock = ExposureClock(settings.latency_s)
        self._context = self._vendor.Freenect2()
        self.serial = self._choose()
        # An absent device crashes the process when it is used, so that it must be in the list just read.
        self._device = self._context.openDevice(self.serial.encode(), pipeline=self._pipeline())
        kinds = self._vendor.FrameType
        self._listener = self._vendor.SyncMultiFrameListener(int(kinds.Color | kinds.Depth))
        self._device.setColorFrameListener(self._listener)
        self._device.setIrAndDepthFrameListener(self._listener)
        self._device.start()
        infrared = self._device.getIrCameraParams()  # zero before start, and where start failed silently
        if not infrared.fx > 0:
            raise NotConnected(
                f"camera {self.serial} did not start; unplug its power for ten seconds, and use a USB 3 port "
                "of an Intel or NEC controller"
            )
        self.intrinsics = {name: float(getattr(infrared, name)) for name in ("fx", "fy", "cx", "cy")}
        self._registration = self._vendor.Registration(infrared, self._device.getColorCameraParams())
        self._undistorted = self._vendor.Frame(WIDTH, HEIGHT, 4)
        self._registered = self._vendor.Frame(WIDTH, HEIGHT, 4)

    def capture(self, timeout_s: float) -> RawFrame:
        """Capture a frame exposed after this call.

        Raises:
            CaptureFailed: None came in time.
            CommunicationLost: The camera is gone.
        """
        asked_s = time.monotonic()
        refused: dict[str, int] = {}
        if self._listener.hasNewFrame():  # from before the call, however old
            self._listener.release(self._listener.waitForNewFrame(milliseconds=1))
        while (left_s := asked_s + timeout_s - time.monotonic()) > 0:
            frames = self._listener.waitForNewFrame(milliseconds=max(1, int(1e3 * min(left_s, _SLICE_S))))
            if frames is None:
                continue
            try:
                result = self._read(frames, asked_s)
            finally:
                self._listener.release(frames)
            if isinstance(result, RawFrame):
                return result
            if result:
                refused[result] = refused.get(result, 0) + 1
        self._explain(timeout_s, refused)

    def _read(self, frames: Any, asked_s: float) -> RawFrame | str:
        """The frame, or why it is refused; empty if it was exposed before the request."""
        arrived_s = time.monotonic()
        depth, colour = frames["depth"], frames["color"]
        if not self._clock.advance_s(depth.timestamp) > 0:
            return "stale (the camera's clock stands still)"
        exposed_s, late_s = self._clock.date(depth.timestamp, arrived_s)
        if late_s > self._settings.latency_s:
            return f"more than {self._settings.latency_s:g} s late (latency_s)"
        skew_s = ((colour.timestamp - depth.timestamp + (1 << 31)) % (1 << 32) - (1 << 31)) * TICK_S
        if abs(skew_s) > self._settings.max_skew_s:
            return f"without colour of the same moment (max_skew_s {self._settings.max_skew_s:g} s)"
        if getattr(depth, "status", 0) or getattr(colour, "status", 0):  # not in every version of the binding
            return "marked as bad by the driver"
        if exposed_s < asked_s:
            return ""
        self._registration.apply(colour, depth, self._undistorted, self._registered)
        return RawFrame(
            depth_mm=self._undistorted.asarray(np.float32).copy(),
            colour_bgrx=self._registered.asarray(np.uint8).copy(),
            exposed_s=exposed_s,
        )

    def _explain(self, timeout_s: float, refused: dict[str, int]) -> NoReturn:
        if self.serial not in self._serials():
            raise CommunicationLost(
                f"camera {self.serial} is unplugged or has lost its power; connect it and open the cell again"
            )
        if refused:
            came = "; ".join(f"{count} {reason}" for reason, count in refused.items())
            raise CaptureFailed(
                f"camera {self.serial} delivered no good frame within {timeout_s:g} s, but {came}; take load "
                "off its USB controller and this machine"
            )
        raise CaptureFailed(
            f"camera {self.serial} delivered no frame within {timeout_s:g} s, its stream stands still; open "
            "the cell again, and if that does not help unplug its power for ten seconds"
        )

    def close(self) -> None:
        """Stop the stream and release the camera."""
        self._device.stop()
        self._device.close()

    def _serials(self) -> list[str]:
        count = self._context.enumerateDevices()
        return [self._context.getDeviceSerialNumber(i).decode(errors="replace") for i in range(count)]

    def _choose(self) -> str:
        found, wanted = self._serials(), self._settings.serial
        if not found:
            raise NotConnected(
                "no Kinect v2 found; check its power supply and USB 3 cable, and that your user may open it "
                "(libfreenect2's 90-kinect2.rules in /etc/udev/rules.d)"
            )
        names = ", ".join(found)
        if wanted is None and len(found) > 1:
            raise NotConnected(f"several Kinects are connected; set camera.serial to one of: {names}")
        if wanted is not None and wanted not in found:
            raise NotConnected(f"camera {wanted} is not connected; connected: {names} (camera.serial)")
        return wanted or found[0]

    def _pipeline(self) -> Any:
        name = {"cpu": "CpuPacketPipeline", "opengl": "OpenGLPacketPipeline"}[self._settings.pipeline]
        if not hasattr(self._vendor, name):
            raise IncompatibleDriver(
                f"this libfreenect2 was built without {name}; set camera.pipeline to cpu"
            )
        return getattr(self._vendor, name)()


def import_vendor() -> Any:
    """The module pylibfreenect2.

    Raises:
        DriverMissing: It, or the library under it, is not installed.
        IncompatibleDriver: It lacks what is needed.
    """
    if importlib.util.find_spec("pylibfreenect2") is None:
        raise DriverMissing(
            "pylibfreenect2 is not installed; build libfreenect2 first (docs/kinect2.md), then "
            "pip install 'mskgrasp[kinect2]'"
        )
    # Once the stand-in is there, `find_spec` refuses it: it has no spec.
    if "pkg_resources" not in sys.modules and importlib.util.find_spec("pkg_resources") is None:
        # pylibfreenect2 0.1.4 asks it for its own version; setuptools 82 has dropped it.
        shim: Any = types.ModuleType("pkg_resources")
        shim.get_distribution = importlib.metadata.distribution
        sys.modules["pkg_resources"] = shim
    try:
        import pylibfreenect2  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise DriverMissing(
            f"pylibfreenect2 cannot be loaded ({error}); put libfreenect2's lib folder into LD_LIBRARY_PATH, "
            "or install the package again after building libfreenect2"
        ) from error
    missing = sorted(name for name in _NAMES if not hasattr(pylibfreenect2, name))
    if missing:
        raise IncompatibleDriver(f"this pylibfreenect2 has no {', '.join(missing)}; install version 0.1.4")
    return pylibfreenect2
