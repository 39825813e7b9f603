"""HTTP connections that end when a client does not get on with its request, or does not take its answer."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle


def closing_after(seconds: float, *, most: int) -> type[H11Protocol]:
    """Make uvicorn's class of connections that close when their client does nothing for some seconds.

    uvicorn itself limits only the pause after an answer: a client that sends its header byte by byte, or
    never, or that does not read what it is sent, would keep its connection for good.

    Args:
        seconds: Shortest time after which a client that has to act is cut off; at most twice as long.
        most: Connections at once; one more is closed as soon as it is made.
    """

    class Connection(H11Protocol):
        """Connection with a limit on the time that its client takes."""

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            if len(self.connections) > most:
                transport.close()
                return
            self._watch(None)

        def _watch(self, before: tuple[RequestResponseCycle | None] | None) -> None:
            """Close if the client had to act at the last look (None: it had not), and still has to."""
            if self.transport.is_closing():
                self.loop.call_later(seconds, self.transport.abort)
                return
            # It has a request to send, or an answer to take.
            waiting = self.cycle is None or self.cycle.response_complete or self.flow.write_paused
            if waiting and before is not None and before[0] is self.cycle:
                self.transport.abort()  # close() would wait until all is taken that was sent
                return
            self.loop.call_later(seconds, self._watch, (self.cycle,) if waiting else None)

    return Connection
