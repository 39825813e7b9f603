"""Devices that record the calls they pass on."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from hal.arm import Arm
from hal.arm_state import ArmState, GraspOutcome, Held
from hal.camera import Camera, RgbdFrame
from hal.cell import PartFeeder, PartTracker
from hal.device import Device, SharingDevice
from hal.errors import HalError
from hal.hand import ConfiguredHand, Load
from hal.replay.events import plain
from hal.replay.writer import RecordingWriter
from mskgrasp.core.geometry import Pose


class _Recorded:
    """A device and the recording of its calls, opened and closed together."""

    def __init__(self, device: Device, writer: RecordingWriter):
        self._device, self._writer = device, writer

    def open(self) -> None:
        self._writer.open()
        try:
            self._device.connect()
        except BaseException:
            self._writer.close()
            raise

    def close(self) -> None:
        try:
            self._device.close()
        finally:
            self._writer.close()


class RecordingCamera(SharingDevice, Camera):
    """A camera whose frames are recorded.

    Args:
        camera: The recorded camera.
        writer: Writer of the recording.
    """

    def __init__(self, camera: Camera, writer: RecordingWriter):
        self._camera, self._writer = camera, writer
        self._resource = _Recorded(camera, writer)

    @property
    def exposures(self) -> int:
        """See `Camera.exposures`."""
        return self._camera.exposures

    @property
    def by_hand(self) -> bool:
        """See `Camera.by_hand`."""
        return self._camera.by_hand

    @property
    def T_base_camera(self) -> Pose | None:
        """See `Camera.T_base_camera`."""
        return self._camera.T_base_camera

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """See `Camera.capture`."""
        return self._writer.call(
            "capture",
            {},
            lambda: self._camera.capture(timeout_s),
            result=lambda frame: self._writer.frame(frame, by_hand=self._camera.by_hand),
        )


class RecordingArm(SharingDevice, Arm):
    """An arm whose commands and answers are recorded.

    Args:
        arm: The recorded arm.
        writer: Writer of the recording.
    """

    def __init__(self, arm: Arm, writer: RecordingWriter):
        super().__init__(arm.limits)
        self.simulated = arm.simulated
        self._arm, self._writer = arm, writer
        self._resource = _Recorded(arm, writer)

    @property
    def may_drop(self) -> bool:
        """See `Arm.may_drop`."""
        return self._arm.may_drop

    def state(self) -> ArmState:
        """See `Arm.state`."""
        return self._writer.call("state", {}, self._arm.state)

    def slow_down(self, pace: float) -> None:
        """See `Arm.slow_down`; not recorded: it changes no call's outcome."""
        self._arm.slow_down(pace)

    def move_to_joints(self, joints: np.ndarray, *, speed: float = 0.3) -> None:
        """See `Arm.move_to_joints`."""
        self._record("move_to_joints", joints=joints, speed=speed)

    def move_to_pose(self, T_base_tcp: Pose, *, speed: float = 0.1) -> None:
        """See `Arm.move_to_pose`."""
        self._record("move_to_pose", T_base_tcp=T_base_tcp, speed=speed)

    def move_until_contact(self, T_base_tcp: Pose, *, force: float = 5.0, speed: float = 0.01) -> Pose | None:
        """See `Arm.move_until_contact`."""
        return self._record("move_until_contact", T_base_tcp=T_base_tcp, force=force, speed=speed)

    def move_gripper(self, width: float) -> None:
        """See `Arm.move_gripper`."""
        self._record("move_gripper", width=width)

    def open_gripper(self) -> None:
        """See `Arm.open_gripper`."""
        self._record("open_gripper")

    def home(self) -> None:
        """See `Arm.home`."""
        self._record("home")

    def grasp(self, force: float) -> GraspOutcome:
        """See `Arm.grasp`."""
        return self._record("grasp", force=force)

    def in_hand(self) -> Held | None:
        """See `Arm.in_hand`; not recorded, as it follows from what is."""
        return self._arm.in_hand()

    def set_load(self, load: Load | None) -> None:
        """See `Arm.set_load`; a refusal, which follows from the recorded limits, is not recorded."""
        if load is not None:
            self.check_load(load.mass)
        self._writer.call("set_load", dict(load=load), lambda: self._arm.set_load(load))

    def hand(self) -> ConfiguredHand | None:
        """See `Arm.hand`; not recorded."""
        return self._arm.hand()

    def wait(self, seconds: float) -> None:
        """See `Arm.wait`."""
        self._record("wait", seconds=seconds)

    def stop(self) -> None:
        """See `Arm.stop`; the arm stops before the call is recorded."""
        self._arm.stop()
        self._writer.call("stop", {}, lambda: None)

    def recover(self) -> None:
        """See `Arm.recover`."""
        self._record("recover")

    def check_pose(self, T_base_tcp: Pose) -> None:
        """See `Arm.check_pose`."""
        self._writer.call("check_pose", dict(T_base_tcp=T_base_tcp), lambda: self._arm.check_pose(T_base_tcp))

    def check_joints(self, joints: np.ndarray) -> None:
        """See `Arm.check_joints`; not recorded, since a replayed cell is not checked."""
        self._arm.check_joints(joints)

    def legs(self, T_base_tcp: Pose) -> list[Pose]:
        """See `Arm.legs`; not recorded."""
        return self._arm.legs(T_base_tcp)

    def _record(self, call: str, **arguments: Any) -> Any:
        return self._writer.call(
            call, arguments, lambda: getattr(self._arm, call)(**arguments), after=self._after
        )

    def _after(self) -> dict[str, Any] | None:
        with contextlib.suppress(HalError):  # an arm that is gone has no state; the command's error says so
            return plain(self._arm.state())
        return None

    def _beneath(self, *_: Any, **__: Any) -> Any:
        raise AssertionError("everything is passed on above the backend")

    _state = _forward = _reachable = _move_to_joints = _move_to_pose = _move_gripper = _beneath
    _move_until_contact = _beneath
    _grasp = _wait = _halt = _recover = _beneath


class RecordingFeeder:
    """A feeder whose presentations are recorded."""

    def __init__(self, feeder: PartFeeder, writer: RecordingWriter):
        self._feeder, self._writer = feeder, writer

    def present(self, part: str, seed: int, *, keep: bool = False) -> None:
        """See `PartFeeder.present`."""
        settings = {"keep": True} if keep else {}
        self._writer.call(
            "present",
            dict(part=part, seed=seed) | settings,
            lambda: self._feeder.present(part, seed, **settings),
        )


class RecordingTracker:
    """A tracker whose poses are recorded."""

    def __init__(self, tracker: PartTracker, writer: RecordingWriter):
        self._tracker, self._writer = tracker, writer

    def part_pose(self) -> Pose:
        """See `PartTracker.part_pose`."""
        return self._writer.call("part_pose", {}, self._tracker.part_pose)
