"""The process in which pylibfreenect2 runs: ``python -m hal.kinect2.worker``.

libfreenect2 crashes the process that uses a camera which another program holds or which was just unplugged,
so it runs apart from the program. When the requests end, the camera is released.
"""

from __future__ import annotations

import os
import signal
from typing import Any

from hal.driver_process import Answer, AnswerPipe, requests
from hal.errors import CommunicationLost, HalError
from hal.kinect2.driver import Kinect2Driver, Kinect2Settings

_CLOSE_S = 5
"""A camera that does not stop is left to the kernel after this, s."""


class Worker:
    """Server that performs requests with the driver."""

    def __init__(self) -> None:
        self._driver: Kinect2Driver | None = None

    def run(self) -> None:
        """Serve until the requests end."""
        pipe = AnswerPipe()
        for request in requests():
            pipe.answer(request, lambda request=request: self._perform(request), _explain)
        if self._driver is not None:
            signal.alarm(_CLOSE_S)
            self._driver.close()

    def _perform(self, request: dict[str, Any]) -> Answer:
        if request["op"] == "connect":
            settings = Kinect2Settings(**request["settings"])
            self._driver = driver = Kinect2Driver(settings)
            driver.capture(settings.timeout_s)
            return Answer(result={"serial": driver.serial, "lens": driver.lens, "colour": driver.colour})
        assert self._driver is not None, "the first request is connect"
        frame = self._driver.capture(request["capture_timeout_s"])
        return Answer(
            result={"exposed_s": frame.exposed_s},
            payload=[image.data.cast("B") for image in (frame.depth_mm, frame.infrared, frame.colour_bgrx)],
        )


def _explain(error: BaseException) -> HalError:
    if isinstance(error, HalError):
        return error
    return CommunicationLost(f"pylibfreenect2 failed ({type(error).__name__}: {error}); open the cell again")


def main() -> None:
    """Serve on the process's own pipes."""
    Worker().run()
    # A destructor may wait for a camera that is gone; the kernel releases it as well.
    os._exit(0)


if __name__ == "__main__":
    main()
