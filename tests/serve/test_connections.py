"""Connections on which nothing comes."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress

import uvicorn

from mskgrasp.serve.connections import closing_after


async def slow(scope, receive, send) -> None:
    await asyncio.sleep(1.0)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


def test_a_client_that_sends_its_header_byte_by_byte_is_cut_off_and_one_that_waits_is_answered():
    async def both() -> tuple[float, bytes]:
        config = uvicorn.Config(
            slow, port=0, http=closing_after(0.3), lifespan="off", log_config=None, ws="none", loop="asyncio"
        )
        server = uvicorn.Server(config)
        task = asyncio.create_task(server._serve())
        while not server.started:
            await asyncio.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]

        async def drip() -> float:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            began = time.monotonic()
            with suppress(ConnectionResetError):
                while time.monotonic() - began < 10:
                    writer.write(b"G")
                    try:
                        if await asyncio.wait_for(reader.read(1), 0.05) == b"":
                            break
                    except TimeoutError:
                        continue
            writer.close()
            return time.monotonic() - began

        async def wait() -> bytes:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
            answer = await asyncio.wait_for(reader.read(), 10)
            writer.close()
            return answer

        found = await asyncio.gather(drip(), wait())
        server.should_exit = True
        await task
        return found[0], found[1]

    seconds, answer = asyncio.run(both())
    assert 0.25 < seconds < 3
    assert answer.startswith(b"HTTP/1.1 200") and answer.endswith(b"ok")
