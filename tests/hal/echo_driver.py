"""A driver without a device, for tests of the transport: it echoes, prints, fails, hangs and crashes."""

from __future__ import annotations

import os
import signal
import time
from typing import Any

from hal.driver_process import Answer, AnswerPipe, requests
from hal.errors import CommunicationLost, HalError

RELEASED = 7
"""Exit code of a driver that has served until the requests ended."""


def perform(request: dict[str, Any]) -> Answer:
    match request["op"]:
        case "echo":
            print("text of a vendor")
            return Answer(result=request["value"], payload=[bytes(request["n_bytes"])])
        case "fail":
            raise ValueError("no such value")
        case "odd":
            return Answer(result=object())
        case "hang":
            time.sleep(60)
        case "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
    return Answer(result=None)


def explain(error: BaseException) -> HalError:
    return CommunicationLost(f"explained: {error}")


if __name__ == "__main__":
    pipe = AnswerPipe()
    for each in requests():
        pipe.answer(each, lambda each=each: perform(each), explain)
    os._exit(RELEASED)
