"""A Kinect v2 over the table."""

from __future__ import annotations

import logging
import math
import threading
from dataclasses import asdict

import numpy as np

from hal.camera import Camera, RgbdFrame
from hal.camera_calibration import Calibration, read_calibration
from hal.driver_process import DriverProcess, ProcessEnded
from hal.errors import (
    CaptureFailed,
    CommunicationLost,
    DriverMissing,
    HalError,
    IncompatibleDriver,
    NotConnected,
)
from hal.kinect2.config import Kinect2Config
from hal.kinect2.driver import Kinect2Settings
from hal.kinect2.images import HEIGHT, WIDTH, Undistortion, metric_depth, unmirrored_intrinsics
from hal.kinect2.registration import COLOUR_HEIGHT, COLOUR_WIDTH, Registration
from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import Pose

_log = logging.getLogger(__name__)
_ERRORS: dict[str, type[HalError]] = {
    kind.__name__: kind
    for kind in (CaptureFailed, CommunicationLost, DriverMissing, IncompatibleDriver, NotConnected)
}
_EXIT_S = 3.0
"""Time the driver has to stop the stream, s; then its process is killed."""
_GRACE_S = 1.0
"""The driver ends a request itself; if it has not this much after the timeout, it hangs, s."""
_ORPHAN_S = 3.0
"""A driver that hangs after its program died is ended by the kernel this much later, s."""


class Kinect2Camera(Camera):
    """Frames of a Kinect v2, upright, metric and in the base frame.

    Args:
        config: Serial number, calibration file and corrections of the camera.
    """

    def __init__(self, config: Kinect2Config):
        self._config = config
        self._lock = threading.Lock()
        self._process: DriverProcess | None = None
        self._lost: str | None = None
        self._serial = ""
        self._intrinsics = np.eye(3)
        self._calibration: Calibration | None = None
        self._undistortion: Undistortion | None = None
        self._registrations: dict[int, Registration] = {}

    @property
    def exposures(self) -> int:
        """See `Camera.exposures`."""
        return self._config.exposures

    @property
    def T_base_camera(self) -> Pose | None:
        """See `Camera.T_base_camera`; None without a valid calibration file."""
        try:
            return read_calibration(self._config.calibration, serial=self._config.serial).T_base_camera
        except BadConfig:  # reported when the camera is connected; the arm may move before it is calibrated
            return None

    @property
    def by_hand(self) -> bool:
        """See `Camera.by_hand`; known once the camera is connected."""
        return self._calibration is not None and self._calibration.by_hand

    def connect(self) -> None:
        """Open the camera and wait for its first frame.

        Raises:
            BadConfig: The calibration file is missing, or another camera's.
            DriverMissing, IncompatibleDriver: pylibfreenect2 is not there, or cannot be used.
            NotConnected: No such camera, or another program holds it.
            CaptureFailed: It is open, but no frame came within ``connect_timeout_s``.
        """
        if self._process is not None:
            return
        config = self._config
        # Before the camera is opened, so that a wrong file does not cost its starting time.
        self._calibration = read_calibration(config.calibration, serial=config.serial)
        settings = Kinect2Settings(
            serial=config.serial,
            pipeline=config.pipeline,
            latency_s=config.latency_s,
            max_skew_s=config.max_skew_s,
            timeout_s=config.connect_timeout_s,
            n_exposures=config.exposures,
        )
        # Opening and starting take up to another ten seconds.
        opening_s = config.connect_timeout_s + 10
        process = DriverProcess(["hal.kinect2.worker"], _ERRORS, _EXIT_S)
        try:
            reply = process.ask(
                "connect",
                timeout_s=opening_s,
                settings=asdict(settings),
                alarm_s=_alarm_s(opening_s),
            ).result
            self._serial = reply["serial"]
            if config.serial is None:
                self._calibration = read_calibration(config.calibration, serial=self._serial)
        except ProcessEnded as error:
            process.close()
            name = f"camera {config.serial}" if config.serial else "the camera"
            raise NotConnected(
                f"{name} could not be opened: {error}; end other programs that use it, check its cable, and "
                "try again"
            ) from error
        except BaseException:
            process.close()
            raise
        self._process, self._lost = process, None
        lens, colour = reply["lens"], reply["colour"]
        pinhole = {name: lens[name] for name in ("fx", "fy", "cx", "cy")}
        self._intrinsics = self._choose_intrinsics(unmirrored_intrinsics(**pinhole))
        self._undistortion = Undistortion(lens)
        self._registrations = {k: Registration(lens, colour, k) for k in {1, config.colour_scale}}
        if config.warm_up_s > 0:
            _log.warning(
                "camera %s has just been started: its depth drifts by millimetres for the first %.0f minutes",
                self._serial,
                config.warm_up_s / 60,
            )

    def close(self) -> None:
        """Stop the stream and release the camera, once a capture of another thread is over."""
        with self._lock:
            if self._process is not None:
                process, self._process = self._process, None
                process.close()

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """Take a frame that is exposed after this call.

        Raises:
            NotConnected: Outside the camera's context.
            CaptureFailed: No complete, fresh and filled frame came within ``timeout_s``.
            CommunicationLost: The camera was unplugged, or its driver crashed or hung; open it again.
        """
        with self._lock:
            if self._process is None or self._calibration is None or self._undistortion is None:
                raise NotConnected("Kinect2Camera is not connected; use it inside its context (with ...)")
            if self._lost is not None:
                raise CommunicationLost(self._lost)
            if not 0 < timeout_s < 3600:
                raise CaptureFailed(f"timeout {timeout_s:g} s is outside 0 .. 3600 s")
            try:
                answer = self._process.ask(
                    "capture",
                    timeout_s=timeout_s + _GRACE_S,
                    capture_timeout_s=timeout_s,
                    alarm_s=_alarm_s(timeout_s),
                )
            except ProcessEnded as error:
                self._lost = f"camera {self._serial} was lost: {error}; open the cell again"
                raise CommunicationLost(self._lost) from error
            except CommunicationLost as error:
                self._lost = str(error)
                raise
        data, n = answer.payload[0], WIDTH * HEIGHT
        raw_depth, raw_infrared = np.frombuffer(data, np.float32, 2 * n).reshape(2, HEIGHT, WIDTH)
        raw_colour = np.frombuffer(data, np.uint8, offset=8 * n).reshape(COLOUR_HEIGHT, COLOUR_WIDTH, 4)
        depth = metric_depth(self._undistortion.nearest(raw_depth), self._config.depth_offset)
        valid = float(np.isfinite(depth).mean())
        if valid < self._config.min_valid:
            raise CaptureFailed(
                f"camera {self._serial} measured {valid:.1%} of its depth image, less than "
                f"{self._config.min_valid:.1%} (min_valid); uncover it, and keep it 0.5 to 4.5 m away"
            )
        # Colour is registered with the corrected depth.
        colours = {
            k: registration.apply(raw_colour, depth) for k, registration in self._registrations.items()
        }
        infrared = self._undistortion.interpolated(raw_infrared)
        return RgbdFrame(
            colour=colours[1],
            depth=depth,
            intrinsics=self._intrinsics.copy(),
            T_base_camera=Pose.from_vector(self._calibration.T_base_camera.as_vector()),
            timestamp_s=answer.result["exposed_s"],
            serial=self._serial,
            fine_colour=colours[self._config.colour_scale] if self._config.colour_scale > 1 else None,
            infrared=np.rint(infrared.clip(0, 65535)).astype(np.uint16),
        )

    def _choose_intrinsics(self, factory: np.ndarray) -> np.ndarray:
        override = self._config.intrinsics.get(self._serial)
        if override is not None:
            return override.matrix()
        if self._config.intrinsics:
            _log.warning(
                "camera.intrinsics names %s, not the connected camera %s: those of its calibration file, or "
                "the factory's, are used; correct the serial number, or remove the key",
                ", ".join(self._config.intrinsics),
                self._serial,
            )
        assert self._calibration is not None
        calibrated = self._calibration.intrinsics
        return factory if calibrated is None else np.asarray(calibrated, dtype=np.float64)


def _alarm_s(timeout_s: float) -> int:
    return math.ceil(timeout_s + _GRACE_S + _ORPHAN_S)
