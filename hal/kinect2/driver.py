"""Driver of a Kinect v2 on pylibfreenect2: opens the camera without crashing and returns fresh frames."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
import time
import types
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from hal.errors import CaptureFailed, CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected
from hal.kinect2.clock import TICK_S, ExposureClock
from hal.kinect2.config import Pipeline
from hal.kinect2.images import median_of_valid
from hal.kinect2.registration import POWERS

_NAMES = {"CpuPacketPipeline", "FrameType", "Freenect2", "SyncMultiFrameListener"}
_LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2")
_COLOUR = (
    "fx", "fy", "cx", "cy", "shift_d", "shift_m",
    *(f"{axis}_x{i}y{j}" for axis in ("mx", "my") for i, j in POWERS),
)  # fmt: skip
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
        n_exposures: Exposures of a frame.
    """

    serial: str | None
    pipeline: Pipeline
    n_exposures: int
    latency_s: float
    max_skew_s: float
    timeout_s: float


@dataclass(frozen=True, kw_only=True)
class RawFrame:
    """Copies of the images that libfreenect2 delivered, mirrored and distorted.

    Attributes:
        depth_mm: (424, 512) float32, 0 where invalid.
        infrared: (424, 512) float32, 0 to 65535.
        colour_bgrx: (1080, 1920, 4) uint8.
        exposed_s: Earliest time of the (first) exposure, monotonic clock, s.
    """

    depth_mm: np.ndarray
    infrared: np.ndarray
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
        self._listener = self._vendor.SyncMultiFrameListener(int(kinds.Color | kinds.Ir | kinds.Depth))
        self._device.setColorFrameListener(self._listener)
        self._device.setIrAndDepthFrameListener(self._listener)
        self._device.start()
        lens = self._device.getIrCameraParams()  # zero before start, and where start failed silently
        if not lens.fx > 0:
            raise NotConnected(
                f"camera {self.serial} did not start; unplug its power for ten seconds, and use a USB 3 port "
                "of an Intel or NEC controller"
            )
        self.lens = {name: float(getattr(lens, name)) for name in _LENS}
        colour = self._device.getColorCameraParams()
        self.colour = {name: float(getattr(colour, name)) for name in _COLOUR}

    def capture(self, timeout_s: float) -> RawFrame:
        """Capture a frame exposed after this call: the median of ``n_exposures`` of depth and infrared.

        Raises:
            CaptureFailed: Not all of them came in time.
            CommunicationLost: The camera is gone.
        """
        asked_s = time.monotonic()
        taken: list[RawFrame] = []
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
                taken.append(result)
                if len(taken) == self._settings.n_exposures:
                    return _merged(taken)
            elif result:
                refused[result] = refused.get(result, 0) + 1
        self._explain(timeout_s, len(taken), refused)

    def _read(self, frames: Any, asked_s: float) -> RawFrame | str:
        """The frame, or why it is refused; empty if it was exposed before the request."""
        arrived_s = time.monotonic()
        depth, infrared, colour = frames["depth"], frames["ir"], frames["color"]
        if not self._clock.advance_s(depth.timestamp, arrived_s) > 0:
            return "stale (the camera's clock stands still)"
        exposed_s, late_s = self._clock.date(depth.timestamp, arrived_s)
        if late_s > self._settings.latency_s:
            return f"more than {self._settings.latency_s:g} s late (latency_s)"
        skew_s = ((colour.timestamp - depth.timestamp + (1 << 31)) % (1 << 32) - (1 << 31)) * TICK_S
        if abs(skew_s) > self._settings.max_skew_s:
            return f"without colour of the same moment (max_skew_s {self._settings.max_skew_s:g} s)"
        if any(getattr(one, "status", 0) for one in (depth, infrared, colour)):  # not in every binding
            return "marked as bad by the driver"
        if exposed_s < asked_s:
            return ""
        return RawFrame(
            depth_mm=depth.asarray(np.float32).copy(),
            infrared=infrared.asarray(np.float32).copy(),
            colour_bgrx=colour.asarray(np.uint8).copy(),
            exposed_s=exposed_s,
        )

    def _explain(self, timeout_s: float, n_taken: int, refused: dict[str, int]) -> NoReturn:
        if self.serial not in self._serials():
            raise CommunicationLost(
                f"camera {self.serial} is unplugged or has lost its power; connect it and open the cell again"
            )
        n = self._settings.n_exposures
        if n_taken:
            others = "".join(f"; {count} were {reason}" for reason, count in refused.items())
            raise CaptureFailed(
                f"camera {self.serial} delivered {n_taken} of {n} exposures within {timeout_s:g} s{others}; "
                "allow more time, lower camera.exposures, or light the scene (in the dark it is slower)"
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


def _merged(taken: Sequence[RawFrame]) -> RawFrame:
    """One frame of several exposures, its colour that of the last."""
    return RawFrame(
        depth_mm=median_of_valid([one.depth_mm for one in taken]),
        infrared=median_of_valid([one.infrared for one in taken]),
        colour_bgrx=taken[-1].colour_bgrx,
        exposed_s=taken[0].exposed_s,
    )


def import_vendor() -> Any:
    """The module pylibfreenect2.

    Raises:
        DriverMissing: It, or the library under it, is not installed.
        IncompatibleDriver: It lacks what is needed.
    """
    if importlib.util.find_spec("pylibfreenect2") is None:
        raise DriverMissing(
            "pylibfreenect2 is not installed; docs/kinect2.md says how to build it and libfreenect2"
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
