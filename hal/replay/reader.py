"""Reader of recordings; every fault of a file is an error in one line."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hal.arm_state import GraspOutcome
from hal.camera import RgbdFrame
from hal.cell import Workspace
from hal.errors import BadRecording, MissingRecording
from hal.gripper import FRANKA_HAND, GripperSpec
from hal.keep_out import from_plain
from hal.limits import ArmLimits
from hal.replay.events import KIND, SCHEMA, Event, arm_state, pose


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Recorded calls on a cell; frames are read from the file on demand.

    Attributes:
        path: The file.
        made: Time of the recording, local time.
        workspace: The cell's table.
        limits: The arm's limits.
        events: All calls, in the order in which they ended.
        n_frames: Number of frames.
        simulated: The arm was simulated.
        by_hand: The camera's pose was measured by hand, as in `Camera.by_hand`.
    """

    path: Path
    made: str
    workspace: Workspace
    limits: ArmLimits
    events: tuple[Event, ...]
    n_frames: int
    simulated: bool
    by_hand: bool

    def frame(self, index: int, timestamp_s: float) -> RgbdFrame:
        """A frame, as if it had been exposed at ``timestamp_s``.

        Raises:
            BadRecording: The file was damaged or taken away meanwhile.
        """
        try:
            with h5py.File(self.path, "r") as file:
                group: Any = file["frames"]
                return RgbdFrame(
                    colour=group["colour"][index],
                    depth=group["depth"][index],
                    intrinsics=group["intrinsics"][index],
                    T_base_camera=pose(group["T_base_camera"][index]),
                    timestamp_s=timestamp_s,
                    serial=str(group.attrs["serial"]),
                    fine_colour=group["fine_colour"][index] if "fine_colour" in group else None,
                    infrared=group["infrared"][index] if "infrared" in group else None,
                )
        except (OSError, KeyError, IndexError, ValueError) as error:
            raise BadRecording(
                f"{self.path}: frame {index} cannot be read ({error}); record again"
            ) from error


def read_recording(path: Path) -> Recording:
    """Read a recording except its images.

    Raises:
        MissingRecording: There is no such file.
        BadRecording: The file is damaged, no recording, or of another version.
    """
    if not path.is_file():
        raise MissingRecording(f"there is no recording {path}; make one with python -m hal.record")
    try:
        with h5py.File(path, "r") as file:
            kind, schema = file.attrs.get("kind"), file.attrs.get("schema")
            if kind != KIND:
                raise BadRecording(f"{path} is no recording of a cell; make one with python -m hal.record")
            if schema != SCHEMA:
                raise BadRecording(f"{path} has schema {schema}, this version reads {SCHEMA}; record again")
            return _read(path, file)
    except (OSError, LookupError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise BadRecording(f"{path} is damaged or no recording ({error}); record again") from error


def _read(path: Path, file: Any) -> Recording:
    table = json.loads(file.attrs["workspace"])
    stored: dict[str, Any] = json.loads(file.attrs["limits"])
    # A recording made before there were keep-outs has none.
    keep_out = tuple(from_plain(one) for one in stored.pop("keep_out", ()))
    # One made before arms stated their gripper is of the Franka Hand.
    gripper: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in stored.pop("gripper", asdict(FRANKA_HAND)).items()
    }
    limits: dict[str, Any] = {
        key: np.array(value) if isinstance(value, list) else value for key, value in stored.items()
    }
    # A recording made before a table had a slope has none.
    tuples: dict[str, Any] = {key: tuple(table[key]) for key in ("region", "table_slope") if key in table}
    events = tuple(_event(text) for text in file["events"].asstr()[:])
    n_frames = _check_frames(file["frames"]) if "frames" in file else 0
    for event in events:
        if event.call == "capture" and event.error is None and not 0 <= event.result < n_frames:
            raise ValueError(f"frame {event.result} is missing")
    return Recording(
        path=path,
        made=str(file.attrs["made"]),
        workspace=Workspace(**{**table, **tuples, "home": np.array(table["home"])}),
        limits=ArmLimits(**limits, keep_out=keep_out, gripper=GripperSpec(**gripper)),
        events=events,
        n_frames=n_frames,
        # A recording made before these were stored plays as one of a simulated, calibrated cell.
        simulated=bool(file.attrs.get("simulated", True)),
        by_hand=bool(file["frames"].attrs.get("by_hand", False)) if n_frames else False,
    )


def _event(text: str) -> Event:
    values = json.loads(text)
    error = values["error"]
    if not isinstance(values["arguments"], dict):
        raise ValueError(f"the arguments of {values['call']} are {values['arguments']!r}")
    event = Event(**{**values, "error": None if error is None else (str(error[0]), str(error[1]))})
    _check_answer(event)
    return event


def _check_answer(event: Event) -> None:
    """Rebuild what a call answered, as a playback does; raises what a broken answer raises."""
    if event.after is not None:
        arm_state(event.after, 0.0)
    if event.error is not None:
        return
    if event.call == "state":
        arm_state(event.result, 0.0)
    elif event.call == "grasp":
        GraspOutcome(**event.result)
    elif event.call == "part_pose" or (event.call == "move_until_contact" and event.result is not None):
        pose(event.result)


def _check_frames(group: Any) -> int:
    n, h, w = group["depth"].shape
    shapes = dict(colour=(n, h, w, 3), intrinsics=(n, 3, 3), T_base_camera=(n, 7), exposed_s=(n,))
    for key, shape in shapes.items():
        if group[key].shape != shape:
            raise ValueError(f"frames/{key} is {group[key].shape}, expected {shape}")
    if "fine_colour" in group:
        scale = group["fine_colour"].shape[1] // h
        if scale < 1 or group["fine_colour"].shape != (n, scale * h, scale * w, 3):
            raise ValueError(f"frames/fine_colour is {group['fine_colour'].shape}, no multiple of depth")
    if "infrared" in group and group["infrared"].shape != (n, h, w):
        raise ValueError(f"frames/infrared is {group['infrared'].shape}, expected {(n, h, w)}")
    if group["depth"].dtype != np.float32 or group["colour"].dtype != np.uint8:
        raise ValueError(f"depth is {group['depth'].dtype}, colour {group['colour'].dtype}")
    return n
