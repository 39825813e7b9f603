"""HTTP connections that end when a client does not get on with its request."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol


def closing_after(seconds: float) -> type[H11Protocol]:
    """Make uvicorn's class of connections that close after some seconds without a request.

    uvicorn itself limits only the pause after an answer: a client that sends its header byte by byte, or
    never, would keep its connection for good.
    """

    class Connection(H11Protocol):
        """Connection with a limit on the time between requests."""

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._watch(None)

        def _watch(self, before: Any) -> None:
            """Close if no request has begun, and none has been open, since the last look."""
            if self.transport.is_closing():
                return
            idle = self.cycle is None or self.cycle.response_complete
            if idle and before == ("idle", id(self.cycle)):
                self.transport.close()
                return
            state = ("idle", id(self.cycle)) if idle else None
            self.loop.call_later(seconds, self._watch, state)

    return Connection
