"""The process in which pylibfreenect2 runs: ``python -m hal.kinect2.worker``.

libfreenect2 crashes the process that uses a camera which another program holds or which was just
unplugged; this process is the one that may crash. One JSON object a line comes in on standard input; out
goes one JSON object a line on what was standard output, after a frame's line its depth and its colour as
plain bytes. When the input ends, because the program closed it or died, the camera is released.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import Any, BinaryIO, TextIO

from hal.errors import CommunicationLost, HalError
from hal.kinect2.driver import Kinect2Driver, Kinect2Settings

_CLOSE_S = 5
"""A camera that does not stop is left to the kernel after this, s."""


def serve(requests: TextIO, replies: BinaryIO) -> None:
    """Answers requests until they end."""
    driver: Kinect2Driver | None = None
    for line in requests:
        request = json.loads(line)
        # The kernel ends a driver that hangs, also where its program was killed and cannot.
        signal.alarm(request["alarm_s"])
        payload: list[memoryview] = []
        try:
            reply: dict[str, Any] = {}
            if request["op"] == "connect":
                settings = Kinect2Settings(**request["settings"])
                driver = Kinect2Driver(settings)
                driver.capture(settings.timeout_s)
                reply = {"serial": driver.serial, "intrinsics": driver.intrinsics}
            else:
                assert driver is not None, "the first request is connect"
                frame = driver.capture(request["timeout_s"])
                reply = {"exposed_s": frame.exposed_s}
                payload = [frame.depth_mm.data.cast("B"), frame.colour_bgrx.data.cast("B")]
        except HalError as error:
            reply = {"error": type(error).__name__, "message": str(error)}
        except Exception as error:  # whatever the vendor raises must reach the other side
            text = f"pylibfreenect2 failed ({type(error).__name__}: {error}); open the cell again"
            reply = {"error": CommunicationLost.__name__, "message": text}
        signal.alarm(0)
        replies.write(json.dumps(reply).encode() + b"\n")
        for part in payload:
            replies.write(part)
        replies.flush()
    if driver is not None:
        signal.alarm(_CLOSE_S)
        driver.close()


def main() -> None:
    """Serves on the process's own pipes."""
    # libfreenect2 logs to standard output; its text must not end up between the answers.
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    serve(sys.stdin, replies)
    # A destructor may wait for a camera that is gone; the kernel releases it as well.
    os._exit(0)


if __name__ == "__main__":
    main()
