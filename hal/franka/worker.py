"""The process in which a vendor's driver runs: ``python -m hal.franka.worker franky``.

Motions run one after the other; ``state`` and ``stop`` are answered at once, also during a motion. When the
requests end, because the program closed them or died, the arm is stopped and the process ends.
"""

from __future__ import annotations

import contextlib
import os
import queue
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, assert_never

import numpy as np

from hal.driver_process import Answer, AnswerPipe, requests
from hal.franka.driver import Driver, DriverName, DriverSettings
from hal.franka.faults import explain
from hal.franka.path import JointPath

_STOP_S = 1.0
"""A moving arm has this long to stop by command when the program ends, s; then its link is cut."""


class Worker:
    """Server that performs requests with a driver.

    Args:
        name: Name of the driver.
    """

    def __init__(self, name: DriverName):
        self._name: DriverName = name
        self._pipe = AnswerPipe()
        self._driver: Driver | None = None
        self._host = "(none)"
        self._motions: queue.Queue[dict[str, Any] | None] = queue.Queue()

    def run(self) -> None:
        """Serve until the requests end."""
        motions = threading.Thread(target=self._run_motions, daemon=True)
        motions.start()
        for request in requests():
            if request["op"] in ("state", "stop"):
                self._answer(request)
            else:
                self._motions.put(request)
        # In a thread: a stop command to a robot that is gone may block for ever.
        threading.Thread(target=self._stop, daemon=True).start()
        self._motions.put(None)
        motions.join(_STOP_S)

    def _stop(self) -> None:
        if self._driver is not None:
            with contextlib.suppress(Exception):  # no program is left to report it to
                self._driver.stop()

    def _run_motions(self) -> None:
        while (request := self._motions.get()) is not None:
            self._answer(request)

    def _answer(self, request: dict[str, Any]) -> None:
        self._pipe.answer(
            request,
            lambda: Answer(result=self._perform(request)),
            lambda error: explain(error, self._name, self._host),
        )

    def _perform(self, request: dict[str, Any]) -> Any:
        if request["op"] == "connect":
            settings = DriverSettings(**request["settings"])
            self._host = settings.host
            driver = new_driver(self._name)
            driver.connect(settings)
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
            "set_load": lambda: driver.set_load(request["mass"], request["centre"], request["inertia"]),
            "move_joints": lambda: driver.move_joints(_path(request)),
            "move_straight": lambda: driver.move_straight(
                _path(request), np.array(request["T_base_tcp"]), request.get("until_force")
            ),
        }
        return verbs[request["op"]]()


def _path(request: dict[str, Any]) -> JointPath:
    return JointPath(seconds=np.array(request["seconds"]), joints=np.array(request["joints"]))


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
    """Serve the driver named on the command line."""
    name: DriverName = "franky" if sys.argv[1] == "franky" else "panda_py"
    Worker(name).run()
    # A vendor's destructor may wait for a robot that is gone; the kernel closes the link as well.
    os._exit(0)


if __name__ == "__main__":
    main()
