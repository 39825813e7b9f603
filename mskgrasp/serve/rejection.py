"""Refusal of a request."""

from __future__ import annotations

import json


class Rejected(Exception):
    """A request that is not answered as asked; the message is one line with the remedy.

    Attributes:
        status: HTTP status: 400 bad input, 401 no token, 404, 408 too slow, 413 too large, 415 another type,
            422 nothing can be planned, 503 busy.
    """

    def __init__(self, status: int, message: str):
        super().__init__(message)
        self.status = status


def error_body(message: str) -> bytes:
    """The JSON that every refusal is answered with: ``{"error": message}``, of one line."""
    line = " ".join(message.split())
    return json.dumps({"error": line if len(line) <= 500 else line[:500] + " ..."}).encode()
