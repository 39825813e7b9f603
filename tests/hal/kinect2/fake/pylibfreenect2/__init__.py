"""Stands in for pylibfreenect2 0.1.4 where there is no Kinect: its names, its views, and its crashes.

What the real package does with a segmentation fault happens here, too: the process dies of SIGSEGV. What
happens is set by a JSON file named in FAKE_KINECT2, read anew at every call: ``serials`` (those connected),
``held`` (those another program uses), ``start_fails``, and ``fault``: "" or one of

    stalled   no frame comes any more          late    every frame is on its way for 1 s more
    frozen    the same frame comes repeatedly   skewed  colour is half a second older than depth
    dark      no pixel is valid                 slow    one frame in 20 s
    hung      waiting never ends                crash   the driver dies while waiting
    refused   stop() never returns

What is seen is set there, too: ``plates`` (`scene.Plate`; a block by default), ``depth_error_mm``, and
``noise_mm`` of depth.
"""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from enum import IntEnum
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np
import pkg_resources

from pylibfreenect2 import scene

__version__ = pkg_resources.get_distribution("numpy").version  # the real one asks for its own
_FIRST_TICKS = 2**32 - 5000  # the counter wraps round 0.6 s after the start
_LATENCY_S = 0.04


class FrameType(IntEnum):
    Color = 1
    Ir = 2
    Depth = 4


def _control() -> dict[str, Any]:
    values = json.loads(Path(os.environ["FAKE_KINECT2"]).read_text(encoding="utf-8"))
    seen = {"plates": [scene.BLOCK_PLATE], "depth_error_mm": scene.DEPTH_ERROR_MM, "noise_mm": 0.0}
    return {"serials": [], "held": [], "start_fails": False, "fault": ""} | seen | values


def _crash() -> NoReturn:
    os.kill(os.getpid(), signal.SIGSEGV)
    raise AssertionError("unreachable")


class Frame:
    def __init__(self, width=None, height=None, bytes_per_pixel=None, frame_type=-1, numpy_array=None):
        given = [value is not None for value in (width, height, bytes_per_pixel)]
        assert all(given) or not any(given)
        if numpy_array is not None:
            _crash()
        self._type = frame_type
        self._own = all(given)
        self._data: np.ndarray | None = None
        self._ticks = self._number = 0
        if self._own:
            shape = (height, width) if bytes_per_pixel == 4 else (height, width, bytes_per_pixel)
            self._data = np.full(shape, 0xDEADBEEF, np.uint32)

    def _memory(self) -> np.ndarray:
        if self._data is None:
            _crash()
        return self._data

    @property
    def timestamp(self):
        self._memory()
        return self._ticks

    @property
    def sequence(self):
        self._memory()
        return self._number

    @property
    def width(self):
        return self._memory().shape[1]

    @property
    def height(self):
        return self._memory().shape[0]

    @property
    def bytes_per_pixel(self):
        self._memory()
        return 4

    @property
    def exposure(self):
        self._memory()
        return 8.0

    @property
    def gain(self):
        self._memory()
        return 1.0

    @property
    def gamma(self):
        self._memory()
        return 1.0

    def asarray(self, dtype=None):
        if dtype is None and self._type < 0:
            raise ValueError("Cannot determine type of data. Specify dtype explicitly.")
        if dtype is None:
            dtype = np.uint8 if self._type == FrameType.Color else np.float32
        if dtype != np.uint8 and dtype != np.float32:
            raise ValueError("np.uint8 or np.float32 is only supported")
        memory = self._memory()
        return (
            memory.view(np.float32)
            if dtype == np.float32
            else memory.view(np.uint8).reshape(*memory.shape, 4)
        )


class FrameMap:
    def __init__(self, take_ownership=False):
        self._frames: dict[FrameType, Frame] = {}

    def __getitem__(self, key):
        if isinstance(key, str):
            names = {"color": FrameType.Color, "ir": FrameType.Ir, "depth": FrameType.Depth}
            if key.lower() not in names:
                raise ValueError("Not supported")
            key = names[key.lower()]
        # std::map's operator[] makes a null pointer of what is not there: the frame's first use crashes.
        return self._frames.get(FrameType(key), Frame(frame_type=int(key)))


class SyncMultiFrameListener:
    def __init__(self, frame_types=7):
        self._types = frame_types
        self._device: Freenect2Device | None = None
        self._taken = -1

    def _newest(self) -> tuple[int, float]:
        """Number of the newest frame that has arrived, and when the next one will."""
        device, fault = self._device, _control()["fault"]
        if device is None or device._started_s is None or fault == "stalled" or device._gone():
            return -1, time.monotonic() + 0.02
        period_s = 20.0 if fault == "slow" else 1 / 30
        delay_s = _LATENCY_S + (1.0 if fault == "late" else 0.0)
        arrived = int((time.monotonic() - device._started_s - delay_s) // period_s)
        return arrived, device._started_s + delay_s + (arrived + 1) * period_s

    def hasNewFrame(self):
        return self._newest()[0] > self._taken

    def waitForNewFrame(self, frame_map=None, milliseconds=-1):
        fault = _control()["fault"]
        if fault == "crash":
            _crash()
        if fault == "hung":
            threading.Event().wait()
        deadline = time.monotonic() + milliseconds / 1e3 if milliseconds >= 0 else float("inf")
        while True:
            number, next_s = self._newest()
            if number > self._taken:
                break
            if time.monotonic() >= deadline:
                return None
            time.sleep(max(0.0, min(next_s, deadline, time.monotonic() + 0.05) - time.monotonic()))
        self._taken = number
        frames = frame_map or FrameMap()
        control = _control()
        fault, plates = control["fault"], json.dumps(control["plates"])
        ticks = _FIRST_TICKS + (0 if fault == "frozen" else round(number / 30 / 0.125e-3))
        for kind in (FrameType.Color, FrameType.Ir, FrameType.Depth):
            if not self._types & kind:
                continue
            frame = Frame(frame_type=int(kind))
            older = 4000 if fault == "skewed" and kind == FrameType.Color else 0
            frame._ticks, frame._number = (ticks - older) % 2**32, number
            if kind == FrameType.Color:
                frame._data = scene.colour_bgrx(plates).copy().view(np.uint32)[..., 0]
            elif kind == FrameType.Ir:
                frame._data = scene.raw_infrared(plates).copy().view(np.uint32)
            else:
                depth = scene.raw_depth_mm(plates, control["depth_error_mm"], control["noise_mm"], number)
                frame._data = (depth * np.float32(fault != "dark")).view(np.uint32)
            frames._frames[kind] = frame
        return frames

    def release(self, frame_map):
        for frame in frame_map._frames.values():
            frame._memory()[:] = 0xDEADBEEF  # a view that was kept shows what has become of its memory
            frame._data = None
        frame_map._frames.clear()


class ColorCameraParams(SimpleNamespace):
    def __init__(self) -> None:
        super().__init__(**dict.fromkeys(scene.COLOUR, 0.0))


class IrCameraParams(SimpleNamespace):
    def __init__(self) -> None:
        super().__init__(**dict.fromkeys(scene.INFRARED, 0.0))


class Registration:
    def __init__(self, irparams, cparams):
        self._ir, self._colour = irparams, cparams
        self._map = scene.undistortion(irparams)

    def apply(
        self,
        rgb,
        depth,
        undistorted,
        registered,
        enable_filter=True,
        bigdepth=None,
        color_depth_map=None,
    ):
        """The real filter against colour seen twice is left out: this scene has none."""
        for frame, size in (
            (rgb, (1920, 1080)),
            (depth, (512, 424)),
            (undistorted, (512, 424)),
            (registered, (512, 424)),
        ):
            if (frame.width, frame.height) != size:
                raise ValueError(f"Shape of frame {frame.width}x{frame.height} is invalid.")
        assert not rgb._own and not depth._own and undistorted._own and registered._own
        raw = depth.asarray(np.float32).reshape(-1)
        flat = np.where(self._map < 0, np.float32(0), raw[np.maximum(self._map, 0)])
        undistorted.asarray(np.float32)[:] = flat
        index = scene.colour_pixels(self._ir, self._colour, flat)
        pixels = rgb._memory().reshape(-1)
        registered._memory()[:] = np.where(index < 0, 0, pixels[np.maximum(index, 0)])


class PacketPipeline:
    pass


class CpuPacketPipeline(PacketPipeline):
    pass


class Freenect2Device:
    """A null pointer where the device could not be opened: any use of it crashes."""

    def __init__(self) -> None:
        self._serial: str | None = None
        self._started_s: float | None = None

    def _pointer(self) -> str:
        if self._serial is None:
            _crash()
        return self._serial

    def _gone(self) -> bool:
        return self._serial not in _control()["serials"]

    def getSerialNumber(self):
        return self._pointer().encode()

    def getFirmwareVersion(self):
        self._pointer()
        return b"4.0.3911.0.7"

    def getColorCameraParams(self):
        return self._params(ColorCameraParams(), scene.COLOUR)

    def getIrCameraParams(self):
        return self._params(IrCameraParams(), scene.INFRARED)

    def _params(self, params: Any, values: dict[str, float]) -> Any:
        self._pointer()
        if self._started_s is not None:
            vars(params).update(values)
        return params

    def setColorFrameListener(self, listener):
        self._pointer()
        listener._device = self

    def setIrAndDepthFrameListener(self, listener):
        self._pointer()
        listener._device = self

    def start(self):
        self.startStreams(True, True)

    def startStreams(self, rgb, depth):
        self._pointer()
        plates = json.dumps(_control()["plates"])
        for draw in (scene.colour_bgrx, scene.raw_infrared, scene.true_depth):
            draw(plates)  # so that the first frame is not late
        if not _control()["start_fails"] and not self._gone():
            self._started_s = time.monotonic()

    def stop(self):
        self._pointer()
        if _control()["fault"] == "refused":
            threading.Event().wait()
        self._started_s = None

    def close(self):
        self._pointer()


class Freenect2:
    def enumerateDevices(self):
        print("[Info] [Freenect2Impl] enumerating devices...")  # the real one logs to standard output, too
        return len(_control()["serials"])

    def getDeviceSerialNumber(self, idx):
        serials = _control()["serials"]
        return serials[idx].encode() if 0 <= idx < len(serials) else b""

    def getDefaultDeviceSerialNumber(self):
        return self.getDeviceSerialNumber(0)

    def openDevice(self, name, pipeline=None):
        control, device = _control(), Freenect2Device()
        if isinstance(name, int):
            name = self.getDeviceSerialNumber(name)
        elif isinstance(name, str):
            raise TypeError("expected bytes, str found")  # Cython's std::string takes bytes alone
        elif not isinstance(name, bytes):
            raise ValueError("device name must be of str, bytes or integer type")
        if name.decode() in control["serials"] and name.decode() not in control["held"]:
            device._serial = name.decode()
        return device

    def openDefaultDevice(self, pipeline=None):
        return self.openDevice(0, pipeline)
