"""Server of the page, and who may connect to it."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.address import is_local, listening, name_of


def require_local(host: str, *, allow_remote: bool) -> None:
    """Refuse an address that other machines can reach, unless that is asked for.

    Raises:
        UsageError: Names the flag, and what it means.
    """
    if not (is_local(host) or allow_remote):
        raise UsageError(
            f"--host {host} can be reached from other machines, and this page can move an arm; forward the "
            "port over SSH (ssh -L 8080:localhost:8080 MACHINE), or give --allow-remote"
        )


def may_connect(host: str, origin: str | None, *, local: bool) -> bool:
    """Whether a request comes from the page itself, or from no page at all.

    A page of another site in the same browser could otherwise press the buttons of this one: browsers let any
    page open a web socket to this machine. Under a name that it has resolved to 127.0.0.1, its origin would
    be that of the request.

    Args:
        host: Header ``Host`` of the request.
        origin: Header ``Origin``, which browsers send with web sockets; None: not sent.
        local: The server can be reached from this machine alone, under a local name.
    """
    if local and not is_local(name_of(host)):
        return False
    return origin is None or urlsplit(origin).netloc == host


class PageServer(viser.ViserServer):
    """A viser server that answers its own page alone and is not shared over the internet.

    Args:
        host: Address to listen on.
        port: Port; 0 for a free one.
        title: Title of the page's panel.

    Raises:
        UsageError: The address is taken, or is not one of this machine.
    """

    def __init__(self, host: str, port: int, title: str):
        # viser would try the ports after a taken one.
        listening(host, port).close()
        with _checked(local=is_local(host)), contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host, port, label=title, verbose=False)
        self.gui.configure_theme(show_logo=False, show_share_button=False)

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse to open a tunnel to a public server, which any client of viser may ask for."""

    def stop(self) -> None:
        """Stop the server; it prints nothing."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()


@contextmanager
def _checked(*, local: bool) -> Iterator[None]:
    """Have the server that is started in the block refuse requests by `may_connect`; viser has no setting."""
    serve = websockets.asyncio.server.serve

    def checked_serve(*args: Any, process_request: Callable[..., Response | None], **settings: Any) -> Any:
        def check(connection: ServerConnection, request: Request) -> Response | None:
            host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
            if not may_connect(host, origin, local=local):
                return connection.respond(HTTPStatus.FORBIDDEN, "open the page by the address printed\n")
            return process_request(connection, request)

        return serve(*args, process_request=check, **settings)

    websockets.asyncio.server.serve = checked_serve  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve
