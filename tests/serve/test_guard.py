"""What is refused before a request is read."""

from __future__ import annotations

import asyncio
import json

import pytest

from mskgrasp.serve.guard import Guard

TOKEN = "correct-horse-battery"


async def hello(scope, receive, send) -> None:
    await asyncio.sleep(scope.get("seconds", 0))
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"{}"})


async def ask(
    guard: Guard, path: str = "/plan", query: str = "", seconds: float = 0, **headers: str
) -> tuple[int, dict]:
    sent: list[dict] = []

    async def send(message):
        sent.append(message)

    async def receive():
        raise AssertionError("nothing is read")

    named = [
        (name.encode(), value.encode()) for name, value in ({"host": "localhost:8093"} | headers).items()
    ]
    await guard(
        {"type": "http", "path": path, "query_string": query.encode(), "headers": named, "seconds": seconds},
        receive,
        send,
    )
    return sent[0]["status"], json.loads(sent[1]["body"])


@pytest.mark.parametrize(
    ("authorization", "status"),
    [(f"Bearer {TOKEN}", 200), (f"bearer {TOKEN}", 200), (TOKEN, 401), ("", 401), (f"Bearer {TOKEN}x", 401),
     (f"Bearer {TOKEN[:-1]}", 401), (f"Basic {TOKEN}", 401), ("Bearer ", 401), ("Bearer \u00e9", 401)],
)  # fmt: skip
def test_only_the_whole_token_is_let_through(authorization: str, status: int):
    guard = Guard(hello, token=TOKEN, most=4)
    found, answer = asyncio.run(ask(guard, authorization=authorization, host="robot.example.org"))
    assert found == status and TOKEN not in str(answer)


def test_health_needs_no_token():
    assert asyncio.run(ask(Guard(hello, token=TOKEN, most=4), "/health"))[0] == 200


@pytest.mark.parametrize(
    ("host", "status"),
    [("127.0.0.1:8093", 200), ("localhost", 200), ("LOCALHOST:1", 200), ("[::1]:8093", 200),
     ("evil.example.org:8093", 400), ("localhost.example.org", 400), ("", 400), ("[::2]:8093", 400),
     ("127.0.1.1:8093", 200), ("[::1", 200)],
)  # fmt: skip
def test_without_a_token_only_local_names_are_let_through(host: str, status: int):
    assert asyncio.run(ask(Guard(hello, token=None, most=4), host=host))[0] == status


def test_parameters_in_the_address_are_not_ignored_but_refused():
    status, answer = asyncio.run(ask(Guard(hello, token=None, most=4), query="seed=3"))
    assert status == 400 and "send them in the body" in answer["error"]


def test_more_requests_at_once_than_allowed_are_503():
    async def three() -> list[int]:
        guard = Guard(hello, token=None, most=2)
        found = await asyncio.gather(*(ask(guard, seconds=0.05) for _ in range(3)))
        return [*(status for status, _ in found), (await ask(guard))[0]]

    assert asyncio.run(three()) == [200, 200, 503, 200]
