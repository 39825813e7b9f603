"""Connections whose clients do nothing, or too little."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

import uvicorn

from mskgrasp.serve.connections import closing_after

GET = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"


async def slow(scope, receive, send) -> None:
    await asyncio.sleep(1.0)
    await quick(scope, receive, send)


async def quick(scope, receive, send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


async def large(scope, receive, send) -> None:
    body = bytes(2**23)
    length = str(len(body)).encode()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", length)]})
    await send({"type": "http.response.body", "body": body})


@asynccontextmanager
async def served(app, seconds: float, most: int = 100) -> AsyncIterator[tuple[uvicorn.Server, int]]:
    """A server and its port."""
    config = uvicorn.Config(
        app, port=0, http=closing_after(seconds, most=most), lifespan="off", log_config=None, ws="none",
        loop="asyncio",
    )  # fmt: skip
    server = uvicorn.Server(config)
    task = asyncio.create_task(server._serve())
    while not server.started:
        await asyncio.sleep(0.01)
    try:
        yield server, server.servers[0].sockets[0].getsockname()[1]
    finally:
        server.should_exit = True
        await task


async def until_none_is_open(server: uvicorn.Server) -> bool:
    for _ in range(1000):
        if not server.server_state.connections and not server.server_state.tasks:
            return True
        await asyncio.sleep(0.01)
    return False


def test_a_client_that_sends_its_header_byte_by_byte_is_cut_off_and_one_that_waits_is_answered():
    async def both() -> tuple[float, bytes]:
        async with served(slow, 0.3) as (_, port):

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
            return found[0], found[1]

    seconds, answer = asyncio.run(both())
    assert 0.25 < seconds < 3
    assert answer.startswith(b"HTTP/1.1 200") and answer.endswith(b"ok")


def test_a_client_that_does_not_take_its_answers_is_cut_off():
    async def never_reads(request: bytes) -> bool:
        async with served(large, 0.2) as (server, port):
            _, writer = await asyncio.open_connection("127.0.0.1", port, limit=1)
            writer.write(request)
            await asyncio.sleep(0.1)
            assert server.server_state.connections
            closed = await until_none_is_open(server)
            writer.close()
            return closed

    assert asyncio.run(never_reads(GET))
    assert asyncio.run(never_reads(2 * GET))  # the second answer waits for the first to be taken


def test_a_connection_too_many_is_closed_and_the_others_stay():
    async def open_five() -> tuple[int, int]:
        async with served(quick, 20.0, most=3) as (server, port):
            opened = [await asyncio.open_connection("127.0.0.1", port) for _ in range(5)]
            ends = await asyncio.gather(*(asyncio.wait_for(one.read(1), 0.5) for one, _ in opened),
                                        return_exceptions=True)  # fmt: skip
            n_open = len(server.server_state.connections)
            for _, writer in opened:
                writer.close()
            return ends.count(b""), n_open

    assert asyncio.run(open_five()) == (2, 3)
