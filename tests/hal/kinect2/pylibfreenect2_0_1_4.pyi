# What pylibfreenect2 0.1.4 (PyPI, 2020-05-20) offers of what is used here, written down from its source
# (github.com/r9y9/pylibfreenect2, tag v0.1.4, libfreenect2.pyx and __init__.py); it ships no stubs itself.
# A frame's `status` and `format`, and the bool that start() returns in C++, do not reach Python.

from enum import IntEnum

import numpy as np

class FrameType(IntEnum):
    Color = 1
    Ir = 2
    Depth = 4

class Frame:
    def __init__(
        self,
        width: int | None = None,
        height: int | None = None,
        bytes_per_pixel: int | None = None,
        frame_type: int = -1,
        numpy_array: np.ndarray | None = None,
    ) -> None: ...
    @property
    def timestamp(self) -> int: ...
    @property
    def sequence(self) -> int: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def bytes_per_pixel(self) -> int: ...
    @property
    def exposure(self) -> float: ...
    @property
    def gain(self) -> float: ...
    @property
    def gamma(self) -> float: ...
    def asarray(self, dtype: type | None = None) -> np.ndarray: ...

class FrameMap:
    def __init__(self, take_ownership: bool = False) -> None: ...
    def __getitem__(self, key: FrameType | str | int) -> Frame: ...

class SyncMultiFrameListener:
    def __init__(self, frame_types: int = 7) -> None: ...
    def hasNewFrame(self) -> bool: ...
    def waitForNewFrame(
        self, frame_map: FrameMap | None = None, milliseconds: int = -1
    ) -> FrameMap | None: ...
    def release(self, frame_map: FrameMap) -> None: ...

class ColorCameraParams:
    fx: float
    fy: float
    cx: float
    cy: float
    shift_d: float
    shift_m: float
    mx_x3y0: float
    mx_x0y3: float
    mx_x2y1: float
    mx_x1y2: float
    mx_x2y0: float
    mx_x0y2: float
    mx_x1y1: float
    mx_x1y0: float
    mx_x0y1: float
    mx_x0y0: float
    my_x3y0: float
    my_x0y3: float
    my_x2y1: float
    my_x1y2: float
    my_x2y0: float
    my_x0y2: float
    my_x1y1: float
    my_x1y0: float
    my_x0y1: float
    my_x0y0: float

class IrCameraParams:
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    k3: float
    p1: float
    p2: float

class Registration:
    def __init__(self, irparams: IrCameraParams, cparams: ColorCameraParams) -> None: ...
    def apply(
        self,
        rgb: Frame,
        depth: Frame,
        undistorted: Frame,
        registered: Frame,
        enable_filter: bool = True,
        bigdepth: Frame | None = None,
        color_depth_map: np.ndarray | None = None,
    ) -> None: ...

class PacketPipeline: ...
class CpuPacketPipeline(PacketPipeline): ...

class Freenect2Device:
    def getSerialNumber(self) -> bytes: ...
    def getFirmwareVersion(self) -> bytes: ...
    def getColorCameraParams(self) -> ColorCameraParams: ...
    def getIrCameraParams(self) -> IrCameraParams: ...
    def setColorFrameListener(self, listener: SyncMultiFrameListener) -> None: ...
    def setIrAndDepthFrameListener(self, listener: SyncMultiFrameListener) -> None: ...
    def start(self) -> None: ...
    def startStreams(self, rgb: bool, depth: bool) -> None: ...
    def stop(self) -> None: ...
    def close(self) -> None: ...

class Freenect2:
    def enumerateDevices(self) -> int: ...
    def getDeviceSerialNumber(self, idx: int) -> bytes: ...
    def getDefaultDeviceSerialNumber(self) -> bytes: ...
    def openDevice(
        self, name: int | str | bytes, pipeline: PacketPipeline | None = None
    ) -> Freenect2Device: ...
    def openDefaultDevice(self, pipeline: PacketPipeline | None = None) -> Freenect2Device: ...
