"""The process in which a vendor's driver runs: ``python -m hal.franka.worker franky``.

One JSON object a line comes in on standard input and goes out on what was standard output. Motions run one
after the other; ``state`` and ``stop`` are answered at once, whatever is going on. When the input ends,
because the program closed it or died, the arm is stopped and the process ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, TextIO, assert_never

import numpy as np

from hal.franka.driver import Driver, DriverName, DriverSettings
from hal.franka.faults import explain
from hal.franka.path import JointPath

_STOP_S = 1.0
"""An arm that moves when the program ends has this long to stop by command, s; then its link is cut."""


class Worker:
    """Answers requests with a driver.

    Args:
        name: Which driver.
        replies: Where answers go.
    """

    def __init__(self, name: DriverName, replies: TextIO):
        self._name: DriverName = name
        self._replies = replies
        self._write = threading.Lock()
        self._driver: Driver | None = None
        self._host = "(none)"
        self._motions: queue.Queue[dict[str, Any] | None] = queue.Queue()

    def run(self, requests: TextIO) -> None:
        """Serves until the input ends."""
        motions = threading.Thread(target=self._run_motions, daemon=True)
        motions.start()
        for line in requests:
            request = json.loads(line)
            if request["op"] in ("state", "stop"):
                self._answer(request)
            else:
                self._motions.put(request)
        # In a thread: whoever asks a robot that is gone to stop may wait for ever.
        threading.Thread(target=self._stop, daemon=True).start()
        self._motions.put(None)
        motions.join(_STOP_S)

    def _stop(self) -> None:
        if self._driver is not None:
            with contextlib.suppress(Exception):  # nobody is left to be told
                self._driver.stop()

    def _run_motions(self) -> None:
        while (request := self._motions.get()) is not None:
            self._answer(request)

    def _answer(self, request: dict[str, Any]) -> None:
        try:
            reply = {"result": self._do(request)}
        except BaseException as error:  # whatever a vendor raises must reach the other side
            fault = explain(error, self._name, self._host)
            reply = {"error": type(fault).__name__, "message": str(fault)}
        with self._write:
            self._replies.write(json.dumps({"id": request["id"], **reply}) + "\n")
            self._replies.flush()

    def _do(self, request: dict[str, Any]) -> Any:
        if request["op"] == "connect":
            settings = DriverSettings(**request["settings"])
            self._host = settings.host
            # Python's lock is held meanwhile. Where the program is killed now, the kernel alone can end this
            # process, which would otherwise take the robot as soon as it is free.
            signal.alarm(request["alarm_s"])
            try:
                driver = new_driver(self._name)
                driver.connect(settings)
            finally:
                signal.alarm(0)
            self._driver = driver
            return None
        driver = self._driver
        assert driver is not None, "the first request is connect"
        verbs: dict[str, Callable[[], Any]] = {
            "state": lambda: asdict(driver.state()),
            "stop": driver.stop,
            "recover": driver.recover,
            "home_gripper": driver.home_gripper,
            "move_gripper": lambda: driver.move_gripper(request["width"], request["speed"]),
            "grasp": lambda: driver.grasp(request["speed"], request["force"]),
            "move": lambda: driver.move(
                JointPath(**{key: np.array(request[key]) for key in ("seconds", "joints", "speeds")})
            ),
        }
        return verbs[request["op"]]()


def new_driver(name: DriverName) -> Driver:
    """The driver of that name; its package is imported here and nowhere else.

    Raises:
        ImportError: The package is not installed.
    """
    match name:
        case "franky":
            from hal.franka.franky_driver import FrankyDriver

            return FrankyDriver()
        case "panda_py":
            from hal.franka.panda_py_driver import PandaPyDriver

            return PandaPyDriver()
        case _:
            assert_never(name)


def main() -> None:
    """Serves the driver named on the command line."""
    name: DriverName = "franky" if sys.argv[1] == "franky" else "panda_py"
    # A vendor may print; its text must not end up between the answers.
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    Worker(name, replies).run(sys.stdin)
    # A vendor's destructor may wait for a robot that is gone; the kernel closes the link as well.
    os._exit(0)


if __name__ == "__main__":
    main()
