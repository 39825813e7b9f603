"""Connection of an arm to its driver's process: requests with deadlines and typed errors."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from hal.driver_process import DriverProcess, NoAnswer, ProcessEnded
from hal.errors import CommunicationLost, MotionAborted, NotConnected
from hal.franka.driver import DriverName, DriverSettings
from hal.franka.faults import ERRORS

_EXIT_S = 2.0
"""Time a driver has to stop the arm and end, s; then its process is killed."""
_ALARM_S = 5
"""A driver that hangs this long after its deadline is ended by the kernel: its program may be gone, s."""


class DriverLink:
    """Connection of a driver in a separate process to a robot.

    Args:
        name: Name of the driver.
        settings: Sent to the driver when it connects.
        connect_timeout_s: Time a robot has to accept the connection, s.

    Raises:
        DriverMissing: Its package is not installed.
        IncompatibleDriver: The robot speaks another version.
        NotConnected: No robot there, or another program holds it.
    """

    def __init__(self, name: DriverName, settings: DriverSettings, connect_timeout_s: float):
        self._host = settings.host
        self._process = DriverProcess(["hal.franka.worker", name], ERRORS, _EXIT_S)
        try:
            self._process.ask(
                "connect",
                timeout_s=connect_timeout_s,
                settings=asdict(settings),
                alarm_s=_alarm_s(connect_timeout_s),
            )
        except NoAnswer as error:
            self.close()
            raise NotConnected(
                f"{settings.host} did not answer within {connect_timeout_s:g} s: the address ('host') may be "
                "wrong, the cable out, or another program may hold the robot, which serves one at a time"
            ) from error
        except (CommunicationLost, MotionAborted) as error:
            self.close()
            raise NotConnected(f"{settings.host}: connecting failed: {error}") from error
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process id of the driver."""
        return self._process.pid

    def ask(self, op: str, *, timeout_s: float, **values: Any) -> Any:
        """Send a request and wait for its answer.

        Raises:
            CommunicationLost: The robot or its driver did not answer within ``timeout_s``, or is gone; the
                process was killed, so that the robot stopped.
            HalError: The driver's own error.
        """
        if op in ("state", "stop"):  # answered in the thread that would notice the program's end
            values["alarm_s"] = _alarm_s(timeout_s)
        try:
            return self._process.ask(op, timeout_s=timeout_s, **values).result
        except ProcessEnded as error:
            raise CommunicationLost(
                f"{self._host}: {error}; the robot has stopped: open the cell again"
            ) from error
        except CommunicationLost:
            self._process.kill()
            raise

    def close(self) -> None:
        """Stop the arm and end the process; safe to call twice."""
        self._process.close()


def _alarm_s(timeout_s: float) -> int:
    return math.ceil(timeout_s) + _ALARM_S
