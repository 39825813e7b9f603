"""Page in a headless browser, controlled over the pipe of the DevTools protocol."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

# The browser reads commands from 3 and answers on 4, where nothing else may lie: a shell cannot promise it.
_CONNECT = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for number, end in zip((3, 4), ends):
    os.dup2(end, number)
os.execv(sys.argv[3], sys.argv[3:])
"""
_PATIENCE_S = 120
_WEBGL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")


def browser() -> str:
    """The browser that `.ci/setup` installs, or another Chromium; its absence is no reason to skip a test."""
    found = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if found is None:
        raise RuntimeError(
            "no Chromium: run make test as root on Debian or Ubuntu, which installs one, or yourself: "
            "sudo apt-get install --no-install-recommends chromium-headless-shell"
        )
    return found


class Page:
    """A page that has been loaded; a context manager.

    Args:
        address: The HTML file, or a server's address that ends with a slash.
        width: Of the window, pixels.
        height: The same.
        webgl: Draw in 3-D, in software, whether there is a GPU or not.

    Attributes:
        complaints: Messages of the browser's console and log, and every request other than for the page.
        errors: Those of them that are errors: the page's own, or requests to elsewhere.
    """

    def __init__(self, address: Path | str, *, width: int = 1000, height: int = 900, webgl: bool = False):
        self.complaints: list[str] = []
        self.errors: list[str] = []
        self._url = address if isinstance(address, str) else address.resolve().as_uri()
        self._webgl = webgl
        self._number = 0
        self._rest = b""
        self._width, self._height = width, height

    def __enter__(self) -> Page:
        hear, says = os.pipe()
        reads, writes = os.pipe()
        options = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--remote-debugging-pipe"]
        options += _WEBGL if self._webgl else ["--disable-gpu"]
        options += [f"--window-size={self._width},{self._height}", "about:blank"]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _CONNECT, str(hear), str(writes), browser(), *options],
            pass_fds=(hear, writes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(hear)
        os.close(writes)
        self._says, self._reads = says, reads
        self._session: str | None = None
        self._frame = ""
        try:
            targets = self._ask("Target.getTargets")["targetInfos"]
            page = next(target for target in targets if target["type"] == "page")
            self._session = self._ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)[
                "sessionId"
            ]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self._ask(f"{domain}.enable")
            self._ask("Page.navigate", url=self._url)
            self._wait_for_load()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        # The browser may be a shell script's child, and outlives it while it draws in 3-D.
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        os.close(self._says)
        os.close(self._reads)

    @property
    def pid(self) -> int:
        """Process id of the browser."""
        return self._process.pid

    def evaluate(self, expression: str) -> Any:
        """The value of an expression of JavaScript on the page, from JSON; promises are awaited."""
        found = self._ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(str(found["exceptionDetails"]))
        return found["result"].get("value")

    def wait_for(self, expression: str, timeout_s: float = 60.0) -> Any:
        """Wait until an expression of JavaScript is true; its value."""
        deadline = time.monotonic() + timeout_s
        while not (found := self.evaluate(expression)):
            if time.monotonic() > deadline:
                text = self.evaluate("document.body.innerText")
                raise RuntimeError(f"{expression} was not true within {timeout_s} s; the page says: {text}")
            time.sleep(0.1)
        return found

    def press(self, label: str) -> None:
        """Press the button with this label, once there is one that can be pressed."""
        button = (
            f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() === {json.dumps(label)})"
        )
        self.wait_for(f"!!{button} && !{button}.disabled")
        self.evaluate(f"{button}.click()")

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the left button of the mouse (``mousePressed``, ``mouseMoved``, ...)."""
        self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def prefer(self, scheme: str) -> None:
        """Show the page as to a reader who prefers ``light`` or ``dark``."""
        preferred = {"name": "prefers-color-scheme", "value": scheme}
        self._ask("Emulation.setEmulatedMedia", features=[preferred])

    def screenshot(self, path: Path) -> None:
        """The page as PNG: all of it, or the window of one that is drawn in 3-D."""
        if self._webgl:
            taken = self._cast()
        else:
            taken = self._ask("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"]
        path.write_bytes(base64.b64decode(taken))

    def _cast(self) -> str:
        """The frame that is drawn next: captureScreenshot waits without end for one drawn in 3-D."""
        self._frame = ""
        self._ask("Page.startScreencast", format="png")
        deadline = time.monotonic() + _PATIENCE_S
        while not self._frame:
            self._take(deadline)
        self._ask("Page.stopScreencast")
        return self._frame

    def _wait_for_load(self) -> None:
        # Events of the empty page before may still come: only the page itself says that it is there.
        deadline = time.monotonic() + _PATIENCE_S
        while not self._is_there():
            if time.monotonic() > deadline:
                raise RuntimeError(f"{self._url} was not loaded within {_PATIENCE_S} s")
            time.sleep(0.05)

    def _is_there(self) -> bool:
        try:
            state = self.evaluate("document.readyState + ' ' + location.href")
        except RuntimeError:
            if self._process.poll() is not None:
                raise
            return False  # between two pages there is none to ask
        return state == f"complete {self._url}"

    def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._says, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + _PATIENCE_S
        while True:
            answer = self._take(deadline)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def _take(self, deadline: float) -> dict[str, Any]:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._reads], [], [], max(0.0, deadline - time.monotonic()))
            piece = os.read(self._reads, 1 << 20) if ready else b""
            if not piece:
                raise RuntimeError(f"the browser ended, or did not answer within {_PATIENCE_S} s")
            self._rest += piece
        line, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(line)
        self._note(message.get("method", ""), message.get("params", {}))
        return message

    def _note(self, method: str, values: dict[str, Any]) -> None:
        match method:
            case "Page.screencastFrame":
                self._frame = values["data"]
            case "Log.entryAdded":
                self._complain(values["entry"]["text"], error=values["entry"]["level"] == "error")
            case "Runtime.consoleAPICalled":
                self._complain(str(values["args"]), error=values["type"] in ("error", "assert"))
            case "Runtime.exceptionThrown":
                self._complain(str(values["exceptionDetails"]), error=True)
            case "Network.requestWillBeSent" if not values["request"]["url"].startswith(("data:", self._url)):
                url = values["request"]["url"]
                self._complain(f"asked for {url}", error=not url.startswith(f"blob:{self._url}"))
            case _:
                pass

    def _complain(self, text: str, *, error: bool) -> None:
        self.complaints.append(text)
        if error:
            self.errors.append(text)
