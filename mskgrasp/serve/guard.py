"""Checks of a request before anything of it is read: host, token, address, number of requests at once."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from mskgrasp.runtime.address import is_local, name_of
from mskgrasp.serve.rejection import error_body

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

OPEN = frozenset({"/health"})
"""Paths that need no token, for monitors."""


class Guard:
    """ASGI application before another one.

    Without a token only requests to a local name are let through: a page that a browser on this machine shows
    could otherwise reach the server under a name of its own, which it has resolved to 127.0.0.1.
    """

    def __init__(self, app: App, *, token: str | None, most: int):
        """Take the application, the token of clients (None: none), and the most requests at once."""
        self._app = app
        self._token = None if token is None else token.encode()
        self._most = most
        self._n_open = 0

    async def __call__(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers: dict[bytes, bytes] = dict(scope["headers"])
        host = headers.get(b"host", b"").decode("latin-1")
        if self._token is None and not is_local(name_of(host)):
            message = f"host {host[:80]!r} is not this server; address it as 127.0.0.1 or localhost"
            await _refuse(send, 400, message)
        elif not (scope["path"] in OPEN or self._admits(headers.get(b"authorization", b""))):
            message = "the token is missing or wrong; send the header 'Authorization: Bearer TOKEN'"
            await _refuse(send, 401, message, (b"www-authenticate", b"Bearer"))
        elif scope["query_string"]:
            await _refuse(send, 400, "parameters in the address are not read; send them in the body")
        elif self._n_open >= self._most:
            message = f"{self._n_open} requests are open; try again in a second"
            await _refuse(send, 503, message, (b"retry-after", b"1"))
        else:
            self._n_open += 1
            try:
                await self._app(scope, receive, send)
            finally:
                self._n_open -= 1

    def _admits(self, authorization: bytes) -> bool:
        if self._token is None:
            return True
        scheme, _, token = authorization.partition(b" ")
        # The time of the comparison does not depend on how much of the token is right.
        return scheme.lower() == b"bearer" and hmac.compare_digest(token.strip(), self._token)


async def _refuse(send: Send, status: int, message: str, *headers: tuple[bytes, bytes]) -> None:
    body = error_body(message)
    described = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *headers,
    ]
    await send({"type": "http.response.start", "status": status, "headers": described})
    await send({"type": "http.response.body", "body": body})
