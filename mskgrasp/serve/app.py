"""Paths of the server and their answers."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
from fastapi import FastAPI, Request, Response
from fastapi.telemetry import TelemetryConfig
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from mskgrasp.core.version import __version__
from mskgrasp.serve.answers import place_answer
from mskgrasp.serve.dispatcher import Dispatcher
from mskgrasp.serve.rejection import Rejected, error_body
from mskgrasp.serve.requests import (
    JSON,
    MAX_PLACE_BYTES,
    NPZ,
    REQUESTS,
    Kind,
    PlaceRequest,
    body_schema,
    parse_json,
)

NO_TELEMETRY: TelemetryConfig = {
    "tracing": False, "metrics": False, "logs": False, "operation_spans": False, "auto_configure": False,
}  # fmt: skip
"""Nothing is reported to anybody, whatever the environment's variables ask FastAPI for."""
PATHS = "POST /plan, /score, /place, GET /health, /models, /openapi.json"


def make_app(
    dispatcher: Dispatcher,
    models: Mapping[str, Any],
    *,
    lowest_grasp_z: Callable[[np.ndarray], np.ndarray],
    max_body: int,
    timeout_s: float,
) -> FastAPI:
    """Make the application.

    Args:
        dispatcher: Answers requests that hold a frame; opened and closed by the application.
        models: Answer to /models.
        lowest_grasp_z: Gives the least z of grasps at points (..., 2), as `hal.Workspace.lowest_grasp_z`.
        max_body: Largest request, bytes.
        timeout_s: Longest time to receive a request, seconds.
    """

    @asynccontextmanager
    async def open_and_close(app: FastAPI) -> AsyncIterator[None]:
        dispatcher.open()
        yield
        await dispatcher.close()

    # No page of documentation: FastAPI's loads scripts from other servers.
    app = FastAPI(
        title="mskgrasp",
        version=__version__,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=open_and_close,
        telemetry=NO_TELEMETRY,
    )
    app.exception_handler(Rejected)(_rejected)
    app.exception_handler(HTTPException)(_no_such_path)
    app.exception_handler(Exception)(_defect)

    async def about_a_frame(kind: Kind, request: Request) -> Response:
        content_type = _content_type(request, (JSON, NPZ))
        remedy = "send a smaller image, or start with a larger --max-body-mb"
        body = await read_body(request, max_body, timeout_s, remedy)
        status, answer = await dispatcher.ask(kind, content_type, body)
        return Response(answer, status, media_type=JSON, headers=_headers(status))

    @app.post("/plan", openapi_extra=body_schema(REQUESTS["plan"]))
    async def plan(request: Request) -> Response:
        """Grasp of the part in the image, its quality and displacement, and alternatives."""
        return await about_a_frame("plan", request)

    @app.post("/score", openapi_extra=body_schema(REQUESTS["score"]))
    async def score(request: Request) -> Response:
        """Quality and displacement of the client's grasps."""
        return await about_a_frame("score", request)

    @app.post("/place", openapi_extra=body_schema(PlaceRequest))
    async def place(request: Request) -> Response:
        """Pose of the hand at which the held part is at the target."""
        _content_type(request, (JSON,))
        remedy = f"send only {', '.join(PlaceRequest.model_fields)}"
        body = await read_body(request, MAX_PLACE_BYTES, timeout_s, remedy)
        return _json(place_answer(parse_json(PlaceRequest, body), lowest_grasp_z))

    @app.get("/health")
    async def health() -> Response:
        """Whether the server can answer: "ok", or with 503 "starting"."""
        ok = dispatcher.status["working"] > 0
        return _json({"status": "ok" if ok else "starting"} | dispatcher.status, 200 if ok else 503)

    @app.get("/models")
    async def about_models() -> Response:
        """The loaded model, the planner's settings, and the table."""
        return _json(models)

    return app


async def read_body(request: Request, most: int, timeout_s: float, remedy: str) -> bytes:
    """Read a request's body.

    Raises:
        Rejected: 413, it has more than ``most`` bytes, and the remedy; 408, it took over ``timeout_s``.
    """
    message = f"the request has more than {most} bytes; {remedy}"
    if int(request.headers.get("content-length", 0)) > most:
        raise Rejected(413, message)
    body = bytearray()
    try:
        async with asyncio.timeout(timeout_s):
            async for chunk in request.stream():
                body += chunk
                if len(body) > most:
                    raise Rejected(413, message)
    except TimeoutError as error:
        raise Rejected(408, f"the request was not received within {timeout_s:g} s; send it again") from error
    except ClientDisconnect as error:
        raise Rejected(400, "the connection ended before the request did; send it again") from error
    return bytes(body)


def _content_type(request: Request, legal: tuple[str, ...]) -> str:
    given = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if given not in legal:
        raise Rejected(415, f"content type {given[:80]!r} is not taken; legal: {', '.join(legal)}")
    return given


def _json(values: Mapping[str, Any], status: int = 200) -> Response:
    return Response(json.dumps(values, allow_nan=False).encode(), status, media_type=JSON)


def _headers(status: int) -> dict[str, str]:
    return {503: {"retry-after": "1"}, 408: {"connection": "close"}}.get(status, {})


async def _rejected(request: Request, error: Exception) -> Response:
    assert isinstance(error, Rejected)
    return Response(error_body(str(error)), error.status, media_type=JSON, headers=_headers(error.status))


async def _defect(request: Request, error: Exception) -> Response:
    message = "the request met a defect of the server; its log has the details"
    return Response(error_body(message), 500, media_type=JSON)


async def _no_such_path(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    message = f"{request.method} {request.url.path[:80]}: {str(error.detail).lower()}; legal: {PATHS}"
    return Response(error_body(message), error.status_code, media_type=JSON, headers=error.headers)
