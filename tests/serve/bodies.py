"""Requests for tests, and a client."""

from __future__ import annotations

import base64
import http.client
import io
import json
from typing import Any

import cv2
import numpy as np

from tests import synthetic

BOX = synthetic.Box(x=0.47, y=0.02, yaw=0.3, size=(0.06, 0.03, 0.03))
FRAME = synthetic.frame([BOX])
JSON, NPZ = "application/json", "application/x-npz"
ARRAYS: dict[str, Any] = {
    "depth": FRAME.depth,
    "intrinsics": FRAME.intrinsics,
    "T_base_camera": FRAME.T_base_camera.as_vector(),
}
ALONG = [BOX.x, BOX.y, 0.02, BOX.yaw]
"""A grasp whose fingers close on the middle of the box's long sides."""


def npz(**changed: Any) -> bytes:
    """The frame with other or more arrays; one that is None is left out."""
    file = io.BytesIO()
    arrays = {name: value for name, value in (ARRAYS | changed).items() if value is not None}
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def png16(depth: np.ndarray = FRAME.depth, scale: float = 1e-4) -> bytes:
    """The depth as a PNG of 16 bits."""
    done, data = cv2.imencode(".png", np.round(depth / scale).astype(np.uint16))
    assert done
    return data.tobytes()


def values(**changed: Any) -> dict[str, Any]:
    """The frame with other or more fields, for JSON; one that is None is left out."""
    fields = {
        "depth_png": base64.b64encode(png16()).decode(),
        "intrinsics": FRAME.intrinsics.tolist(),
        "T_base_camera": FRAME.T_base_camera.as_vector().tolist(),
    }
    return {name: value for name, value in (fields | changed).items() if value is not None}


def text(**changed: Any) -> bytes:
    return json.dumps(values(**changed)).encode()


class Client:
    """Requests to a server on this machine."""

    def __init__(self, port: int, token: str | None = None):
        self.port, self.token = port, token

    def ask(
        self, path: str, body: bytes | None = None, content_type: str = JSON, **headers: str
    ) -> tuple[int, Any]:
        """Status, and the JSON of the answer; GET without a body."""
        sent = dict(headers)
        if body is not None:
            sent["Content-Type"] = content_type
        if self.token is not None:
            sent["Authorization"] = f"Bearer {self.token}"
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request("GET" if body is None else "POST", path, body, sent)
            answer = connection.getresponse()
            assert answer.headers.get_content_type() == JSON
            return answer.status, json.loads(answer.read())
        finally:
            connection.close()
