"""Calls on a cell as plain values: arguments, results, errors."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from hal import errors as hal_errors
from hal.arm_state import ArmState, GraspOutcome
from hal.errors import HalError, Stopped
from hal.gripper import GripperSpec
from hal.hand import Load
from hal.keep_out import Box, Capsule, to_plain
from mskgrasp.core import errors as base_errors
from mskgrasp.core.errors import MskgraspError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING

SCHEMA = 1
KIND = "mskgrasp cell recording"

Command = Literal[
    "capture", "present", "move_to_joints", "move_to_pose", "move_until_contact", "move_gripper",
    "open_gripper", "home", "grasp", "wait", "recover",
]  # fmt: skip
COMMANDS: tuple[str, ...] = get_args(Command)
"""Calls that act, in sequence; the calls between them are queries."""

_ERRORS: dict[str, type[MskgraspError]] = {
    name: kind
    for module in (base_errors, hal_errors)
    for name, kind in vars(module).items()
    if isinstance(kind, type) and issubclass(kind, MskgraspError)
}


@dataclass(frozen=True, kw_only=True)
class Event:
    """One call.

    Attributes:
        call: Name.
        arguments: Plain values; poses as x y z qw qx qy qz.
        result: Plain values; for a capture, the index of the frame.
        error: Type and message of the raised error, or None.
        at_s: Time of the call, seconds since the recording began.
        took_s: Its duration, s.
        after: The arm's state after a command; None if it could not be read.
    """

    call: str
    arguments: dict[str, Any] = field(default_factory=dict)
    result: Any = None
    error: tuple[str, str] | None = None
    at_s: float = 0.0
    took_s: float = 0.0
    after: dict[str, Any] | None = None


def plain(value: Any) -> Any:
    """Plain values of the arguments and results of a cell's methods."""
    match value:
        case Pose():
            return np.asarray(value.as_vector(), dtype=np.float64).tolist()
        case ArmState():
            return dict(
                joints=plain(value.joints),
                T_base_tcp=plain(value.T_base_tcp),
                width=float(value.gripper_width),
                grasped=None if value.grasped is None else bool(value.grasped),
                max_width=float(value.max_width),
            )
        case Capsule() | Box():
            return to_plain(value)
        case tuple() if value and all(isinstance(one, Capsule | Box) for one in value):
            return [to_plain(one) for one in value]
        case GripperSpec():
            return asdict(value)
        case GraspOutcome():
            return dict(width=float(value.width), holding=bool(value.holding))
        case Load():
            return dict(
                mass=float(value.mass), centre_tcp=plain(value.centre_tcp), inertia=plain(value.inertia)
            )
        case np.ndarray() | np.generic():
            return value.tolist()
        case _:
            return value


def arm_state(values: dict[str, Any], timestamp_s: float) -> ArmState:
    """The state that `plain` wrote; one of an older recording reports neither grasp nor greatest width."""
    return ArmState(
        joints=np.array(values["joints"]),
        T_base_tcp=pose(values["T_base_tcp"]),
        gripper_width=float(values["width"]),
        timestamp_s=timestamp_s,
        grasped=values.get("grasped"),
        max_width=values.get("max_width", MAX_OPENING),
    )


def pose(values: list[float]) -> Pose:
    """The pose that `plain` wrote.

    Raises:
        ValueError: They are not seven numbers.
    """
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (7,):
        raise ValueError(f"a pose is {values!r}, not x y z qw qx qy qz")
    return Pose.from_vector(vector)


def rebuild(error: tuple[str, str]) -> MskgraspError:
    """The error that was raised when it was recorded."""
    name, message = error
    if name == KeyboardInterrupt.__name__:
        return Stopped("at this point of the recording Ctrl-C was pressed; call recover()")
    return _ERRORS.get(name, HalError)(message)
