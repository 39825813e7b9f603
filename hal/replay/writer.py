"""Writer of recordings, HDF5 files described in docs/replay.md."""

from __future__ import annotations

import errno
import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from hal.arm import Arm
from hal.camera import RgbdFrame
from hal.cell import Workspace
from hal.replay.events import KIND, SCHEMA, Event, plain
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import require_space
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

T = TypeVar("T")


class RecordingWriter:
    """Writer of calls as they happen; ``FILE.part`` becomes ``FILE`` when the last user closes it.

    Args:
        path: The recording; must not exist yet.
        workspace: The table of the recorded cell.
        arm: The recorded arm; its limits are stored, and whether it is simulated.

    Raises:
        UsageError: The file exists, or its folder cannot be written.
    """

    def __init__(self, path: Path, workspace: Workspace, arm: Arm):
        self._path = path
        self._refuse_existing()
        if self.part.exists():
            raise UsageError(
                f"{self.part} is there, of a program that is recording or was killed; move it away (it can "
                "be played back) or choose another file"
            )
        self._table = {key: plain(value) for key, value in asdict(workspace).items()}
        self._limits = {key: plain(value) for key, value in vars(arm.limits).items()}
        self._simulated = arm.may_drop
        self._lock = threading.Lock()
        self._users = 0
        self._file: h5py.File | None = None
        self._start_s = 0.0

    @property
    def part(self) -> Path:
        """The file while it is being written."""
        return self._path.with_name(self._path.name + ".part")

    def open(self) -> None:
        """Create the file for its first user.

        Raises:
            UsageError: It exists, of a connection before this one, or cannot be written.
        """
        if self._file is None:
            self._refuse_existing()
        self._users += 1
        if self._file is None:
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                require_space(self.part)
                self._file = h5py.File(self.part, "x")
            except OSError as error:
                self._users -= 1
                reason = error.strerror or error
                raise UsageError(f"cannot write {self.part}: {reason}; choose another file") from error
            self._start_s = time.monotonic()
            self._file.attrs.update(
                kind=KIND,
                schema=SCHEMA,
                made=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
                units="metres, radians, newtons, seconds; poses x y z qw qx qy qz in the base frame",
                workspace=json.dumps(self._table),
                limits=json.dumps(self._limits),
                simulated=self._simulated,
            )
            self._file.create_dataset("events", (0,), h5py.string_dtype(), maxshape=(None,), chunks=(64,))
            self._file.flush()

    def _refuse_existing(self) -> None:
        if self._path.exists():
            raise UsageError(f"{self._path} exists already; move it away or choose another file")

    def close(self) -> None:
        """Finish the file after its last user; delete one without calls (the cell did not open)."""
        self._users = max(0, self._users - 1)
        if self._users == 0 and self._file is not None:
            with ctrl_c_deferred():
                with self._lock:
                    file, self._file = self._file, None
                    with self._named_in_errors():
                        events: Any = file["events"]
                        n_events = len(events)
                        file.close()
                if n_events:
                    os.replace(self.part, self._path)
                else:
                    self.part.unlink()

    def call(
        self,
        name: str,
        arguments: dict[str, Any],
        do: Callable[[], T],
        *,
        result: Callable[[T], Any] = plain,
        after: Callable[[], dict[str, Any] | None] = lambda: None,
    ) -> T:
        """Perform a call and record its result or error.

        Args:
            name: Name of the method.
            arguments: Its arguments.
            do: Performs the call.
            result: Converts the returned value to plain values.
            after: Reads the arm's state after the call.
        """
        begun_s = time.monotonic()
        error: tuple[str, str] | None = None
        value = None
        try:
            answer = do()
            value = result(answer)
            return answer
        except BaseException as raised:
            error = (type(raised).__name__, str(raised))
            raise
        finally:
            took_s = time.monotonic() - begun_s
            self._append(
                Event(
                    call=name,
                    arguments={key: plain(argument) for key, argument in arguments.items()},
                    result=value,
                    error=error,
                    at_s=begun_s - self._start_s,
                    took_s=took_s,
                    after=after(),
                )
            )

    def frame(self, frame: RgbdFrame, *, by_hand: bool = False) -> int:
        """Store a frame and return its index; ``by_hand`` as in `Camera.by_hand`.

        Raises:
            OSError: The disk is nearly full; what was recorded until then is kept.
        """
        with self._lock:
            if self._file is None:
                return -1
            require_space(self.part)
            optional = dict(fine_colour=frame.fine_colour, infrared=frame.infrared)
            values = dict(
                colour=frame.colour,
                depth=frame.depth,
                intrinsics=frame.intrinsics,
                T_base_camera=np.asarray(frame.T_base_camera.as_vector(), dtype=np.float64),
                exposed_s=np.float64(frame.timestamp_s - self._start_s),
                **{key: image for key, image in optional.items() if image is not None},
            )
            group = self._file.require_group("frames")
            if not group.keys():
                group.attrs.update(serial=frame.serial, by_hand=by_hand)
                for key, value in values.items():
                    array = np.asarray(value)
                    packed: dict[str, Any] = dict(compression="gzip", compression_opts=1, shuffle=True)
                    group.create_dataset(
                        key,
                        (0, *array.shape),
                        array.dtype,
                        maxshape=(None, *array.shape),
                        chunks=(1, *array.shape),
                        **(packed if array.ndim > 1 else {}),
                    )
            index = group["depth"].shape[0]  # pyright: ignore[reportAttributeAccessIssue]
            # A frame without all of its images would make the whole recording unreadable.
            with self._named_in_errors(), ctrl_c_deferred():
                for key, value in values.items():
                    dataset: Any = group[key]
                    dataset.resize(index + 1, axis=0)
                    dataset[index] = value
            return index

    @contextmanager
    def _named_in_errors(self) -> Iterator[None]:
        """Give an error of HDF5, which is a page long, in a line with the file's name."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            raise OSError(errno.EIO, "HDF5 cannot write", str(self.part)) from error

    def _append(self, event: Event) -> None:
        with self._lock:
            if self._file is None:
                return
            with self._named_in_errors(), ctrl_c_deferred():
                events: Any = self._file["events"]
                events.resize(len(events) + 1, axis=0)
                events[-1] = json.dumps(asdict(event))
                self._file.flush()  # what is known must survive the program
