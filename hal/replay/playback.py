"""Position in a recording, and comparison of the program's calls with the recorded ones."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import Any

import numpy as np

from hal.errors import CaptureFailed, NotRecorded
from hal.replay.config import Tolerances
from hal.replay.events import COMMANDS, Event, pose, rebuild
from hal.replay.reader import Recording
from mskgrasp.core.geometry import pose_distance


class Playback:
    """Position in a recording's commands; queries are answered from those between two commands.

    Args:
        recording: Recorded calls.
        calls: Names of the commands to replay; others are skipped.
        tolerances: Greatest differences between a command and the recorded one.
        loop: Restart after the last command.
    """

    def __init__(
        self,
        recording: Recording,
        calls: Iterable[str] = COMMANDS,
        tolerances: Tolerances | None = None,
        *,
        loop: bool = False,
    ):
        self.recording = recording
        self._tolerances = tolerances or Tolerances()
        self._loop = loop
        self._calls = frozenset(calls)
        self._commands = [i for i, event in enumerate(recording.events) if event.call in self._calls]
        self._lock = threading.Lock()
        self._users = 0
        self._next = 0
        self._answered: dict[str, int] = {}

    def open(self) -> None:
        """Register a user; the first one rewinds the recording."""
        with self._lock:
            if self._users == 0:
                self._next, self._answered = 0, {}
            self._users += 1

    def close(self) -> None:
        """Unregister a user."""
        with self._lock:
            self._users = max(0, self._users - 1)

    def command(self, call: str, arguments: dict[str, Any]) -> Event:
        """The recorded command, if it is the one that comes next; raises what it raised.

        Raises:
            NotRecorded: Another command, or none, comes next; the playback stays where it is.
            CaptureFailed: A camera that plays back alone has no frame left.
        """
        with self._lock:
            if self._next == len(self._commands) and self._loop and self._commands:
                self._next = 0
            if self._next == len(self._commands):
                if self._calls == {"capture"}:
                    if not self._commands:
                        raise CaptureFailed(f"{self.recording.path} holds no frame; record some")
                    raise CaptureFailed(
                        f"all {len(self._commands)} frames of {self.recording.path} have been taken; record "
                        "more, or set camera.loop to true"
                    )
                raise NotRecorded(
                    f"{self.recording.path} ends after {len(self._commands)} commands; the program asks for "
                    f"{_words(call, arguments)}"
                )
            event = self.recording.events[self._commands[self._next]]
            if event.call != call or not self._same(event.arguments, arguments):
                raise NotRecorded(
                    f"command {self._next + 1} of {self.recording.path} was "
                    f"{_words(event.call, event.arguments)}; the program asks for {_words(call, arguments)}"
                )
            self._next += 1
            self._answered = {}
        if event.error is not None:
            raise rebuild(event.error)
        return event

    def peek(self) -> Event | None:
        """The command that comes next; None at the end."""
        with self._lock:
            if self._next == len(self._commands):
                return None
            return self.recording.events[self._commands[self._next]]

    def answer(self, call: str) -> Event | None:
        """The answer to a query at this point: those recorded in their order, then the last again."""
        with self._lock:
            events = self.recording.events
            begin, end = self._window()
            found = [event for event in events[begin:end] if event.call == call]
            if not found:
                return None
            index = self._answered.get(call, 0)
            self._answered[call] = index + 1
            event = found[min(index, len(found) - 1)]
        if event.error is not None:
            raise rebuild(event.error)
        return event

    def last_state(self) -> dict[str, Any] | None:
        """The latest known state of the arm before this point; None if there is none."""
        with self._lock:
            for event in reversed(self.recording.events[: self._window()[1]]):
                if event.call == "state" and event.error is None:
                    return event.result
                if event.after is not None:
                    return event.after
            return None

    def same_question(self, call: str, arguments: dict[str, Any]) -> Event:
        """The answer to the nearest query, which does not depend on its time; raises what it raised.

        Raises:
            NotRecorded: The recording holds no such query.
        """
        found = [
            event
            for event in self.recording.events
            if event.call == call and self._same(event.arguments, arguments)
        ]
        if not found:
            raise NotRecorded(
                f"{self.recording.path} holds no {_words(call, arguments)}, for which the program asks; "
                "start it with the options with which it was recorded"
            )
        event = min(found, key=lambda one: _apart(one.arguments, arguments))
        if event.error is not None:
            raise rebuild(event.error)
        return event

    def _window(self) -> tuple[int, int]:
        """Indices of the events between the command before and the one that comes next."""
        begin = self._commands[self._next - 1] + 1 if self._next else 0
        end = self._commands[self._next] if self._next < len(self._commands) else len(self.recording.events)
        return begin, end

    def _same(self, recorded: dict[str, Any], given: dict[str, Any]) -> bool:
        return recorded.keys() == given.keys() and all(
            self._same_value(key, recorded[key], given[key]) for key in recorded
        )

    def _same_value(self, key: str, recorded: Any, given: Any) -> bool:
        limit = self._tolerances
        if key == "T_base_tcp":
            if not np.isfinite([*recorded, *given]).all():
                return bool(np.array_equal(recorded, given, equal_nan=True))
            distance, angle = pose_distance(pose(recorded), pose(given))
            return distance <= limit.position and angle <= limit.rotation
        if isinstance(recorded, str) or isinstance(given, str):
            return recorded == given
        one, other = np.asarray(recorded, dtype=np.float64), np.asarray(given, dtype=np.float64)
        allowed = {"joints": limit.joints, "width": limit.width, "seed": 0.0}.get(key, limit.other)
        return one.shape == other.shape and bool(
            np.allclose(one, other, rtol=0, atol=allowed, equal_nan=True)
        )


def _apart(recorded: dict[str, Any], given: dict[str, Any]) -> float:
    """Greatest difference of numbers of two queries with the same arguments."""
    differences = [
        np.abs(np.asarray(recorded[key], dtype=np.float64) - np.asarray(given[key], dtype=np.float64))
        for key in recorded
    ]
    return max((float(np.nan_to_num(one).max()) for one in differences), default=0.0)


def _words(call: str, arguments: dict[str, Any]) -> str:
    shown = ", ".join(
        f"{key} {value if isinstance(value, str) else np.round(value, 4).tolist()}"
        for key, value in arguments.items()
    )
    return f"{call}({shown})"
