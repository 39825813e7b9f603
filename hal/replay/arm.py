"""Arm that replays a recording."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from hal.arm import Arm
from hal.arm_state import ArmState, GraspOutcome, Held
from hal.device import SharingDevice
from hal.errors import LoadTooHeavy, NeedsRecovery, NotRecorded, OutOfWorkspace, Stopped
from hal.hand import Load
from hal.motion_gate import STOPPED
from hal.replay.config import ReplayArmConfig
from hal.replay.events import COMMANDS, arm_state, plain, pose
from hal.replay.playback import Playback
from hal.replay.reader import read_recording
from mskgrasp.core.errors import MskgraspError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING


class ReplayArm(SharingDevice, Arm):
    """Arm that compares each command with the recorded one and returns the recorded answer or error.

    A command that differs by more than the tolerances is refused (`NotRecorded`): it is unknown what the
    arm would have done. Limits were checked by the recorded arm; nothing moves here.

    Args:
        config: Recording and tolerances.
        playback: Shared with the camera of the same recording, so that both stay in step.

    Raises:
        BadRecording: The file is missing, damaged or of another version.
    """

    simulated = True

    def __init__(self, config: ReplayArmConfig, playback: Playback | None = None):
        calls = [call for call in COMMANDS if call not in ("capture", "present")]
        self._resource = self._playback = playback or Playback(
            read_recording(config.recording), calls, config.tolerances
        )
        super().__init__(self._playback.recording.limits)
        # The fault is this program's, not the recorded one's: what acknowledges it was not recorded, either.
        self._astray = False

    @property
    def may_drop(self) -> bool:
        """Whether the recorded arm was simulated."""
        return self._playback.recording.simulated

    def connect(self) -> None:
        """Go to the beginning of the recording."""
        if not self._open:
            super().connect()
            self._acknowledge()

    def state(self) -> ArmState:
        """The state that was read at this point, or the last one known; its time is that of this call.

        Raises:
            NotConnected: Outside the arm's context.
            NotRecorded: The recording has not read any state until here.
        """
        self._require_connection()
        event = self._playback.answer("state")
        values = event.result if event is not None else self._playback.last_state()
        if values is None:
            raise NotRecorded(
                f"{self._playback.recording.path} holds no state of the arm until here, for which the "
                "program asks; start it with the options with which it was recorded"
            )
        return arm_state(values, time.monotonic())

    def move_to_joints(self, joints: np.ndarray, *, speed: float = 0.3) -> None:
        """See `Arm.move_to_joints`."""
        self._replay("move_to_joints", joints=joints, speed=speed)

    def move_to_pose(self, T_base_tcp: Pose, *, speed: float = 0.1) -> None:
        """See `Arm.move_to_pose`."""
        self._replay("move_to_pose", T_base_tcp=T_base_tcp, speed=speed)

    def move_until_contact(self, T_base_tcp: Pose, *, force: float = 5.0, speed: float = 0.01) -> Pose | None:
        """See `Arm.move_until_contact`."""
        contact = self._replay("move_until_contact", T_base_tcp=T_base_tcp, force=force, speed=speed)
        return None if contact is None else pose(contact)

    def move_gripper(self, width: float) -> None:
        """See `Arm.move_gripper`."""
        self._replay("move_gripper", width=width)
        self._held = None

    def open_gripper(self) -> None:
        """See `Arm.open_gripper`; an older recording has the width that opened the hand instead."""
        following = self._playback.peek()
        if following is not None and following.call == "move_gripper":
            self._replay("move_gripper", width=MAX_OPENING)
        else:
            self._replay("open_gripper")
        self._held = None

    def home(self) -> None:
        """See `Arm.home`."""
        self._replay("home")
        self._held = None

    def grasp(self, force: float) -> GraspOutcome:
        """See `Arm.grasp`."""
        outcome = GraspOutcome(**self._replay("grasp", force=force))
        values = self._playback.last_state()
        at = None if values is None else pose(values["T_base_tcp"])
        self._held = Held(T_base_tcp=at, width=outcome.width) if at is not None and outcome.holding else None
        return outcome

    def in_hand(self) -> Held | None:
        """What the recorded hand held; None also where a person took it, after which the fingers opened."""
        self._require_connection()
        held, values, following = self._held, self._playback.last_state(), self._playback.peek()
        opened = following is not None and following.call in ("move_gripper", "open_gripper")
        if held is None or values is None or opened:
            return None
        return None if held.lost(values["width"]) or not self.holds(arm_state(values, 0.0)) else held

    def set_load(self, load: Load | None) -> None:
        """Accept a load as the recorded arm did, or as any arm where the recording has none at this point.

        Raises:
            LoadTooHeavy: It is more than the recorded arm carries.
        """
        self._require_connection()
        if load is not None:
            self.check_load(load.mass)
        self._gate.require_no_fault()
        try:
            self._playback.answer("set_load")
        except (LoadTooHeavy, NeedsRecovery):
            raise  # no fault
        except MskgraspError as error:
            self._gate.fault = str(error)
            raise

    def hand(self) -> None:
        """None: a recording does not hold it."""

    def wait(self, seconds: float) -> None:
        """Do not wait; see `Arm.wait`."""
        self._replay("wait", seconds=seconds)

    def recover(self) -> None:
        """Acknowledge a recorded error, or a command that differed from the recording."""
        self._require_connection()
        if not self._astray:
            self._step("recover", {})
        self._acknowledge()

    def check_pose(self, T_base_tcp: Pose) -> None:
        """Refuse a target that the recorded arm refused.

        Raises:
            OutOfWorkspace: The recorded arm refused it.
            NotRecorded: The recording holds no such call.
        """
        self._playback.same_question("check_pose", {"T_base_tcp": plain(T_base_tcp)})

    def legs(self, T_base_tcp: Pose) -> list[Pose]:
        """Not recorded.

        Raises:
            NotRecorded: Always.
        """
        raise NotRecorded("recordings do not hold by which motions the arm goes; ask the cell itself")

    def check_joints(self, joints: np.ndarray) -> None:
        """Not recorded.

        Raises:
            NotRecorded: Always.
        """
        raise NotRecorded("recordings hold no checks of joints; ask the cell itself")

    def _replay(self, call: str, **arguments: Any) -> Any:
        self._require_connection()
        following = self._playback.peek()
        error = following.error[0] if following is not None and following.error is not None else None
        if error != NeedsRecovery.__name__:
            self._gate.require_no_fault()
        # A recorded stop ended a recorded motion; one that comes now ends this one.
        if self._stop.is_set() and error is None:
            self._gate.fault, self._astray = "stop() was called", True
            raise Stopped(STOPPED)
        return self._step(call, {key: plain(value) for key, value in arguments.items()})

    def _step(self, call: str, arguments: dict[str, Any]) -> Any:
        try:
            return self._playback.command(call, arguments).result
        except (OutOfWorkspace, NeedsRecovery):
            raise  # no fault: nothing had moved
        except MskgraspError as error:
            self._gate.fault, self._astray = str(error), isinstance(error, NotRecorded)
            raise

    def _acknowledge(self) -> None:
        self._gate.fault, self._astray = None, False
        self._stop.clear()

    def _halt(self) -> None:
        """Do nothing: nothing moves."""

    def _beneath(self, *_: Any, **__: Any) -> Any:
        raise AssertionError("a recording answers above the backend")

    _state = _forward = _reachable = _move_to_joints = _move_to_pose = _move_gripper = _beneath
    _move_until_contact = _beneath
    _grasp = _wait = _recover = _beneath
