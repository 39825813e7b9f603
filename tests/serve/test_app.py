"""Requests to a real server, right and wrong."""

from __future__ import annotations

import base64
import http.client
import json
import socket
from typing import Any

import numpy as np
import pytest

from tests.serve.bodies import ALONG, ARRAYS, FRAME, JSON, NPZ, npz, png16, text, values
from tests.serve.conftest import BODY_MB, Server

PLACE: dict[str, Any] = {
    "grasp": ALONG,
    "displacement": [0.0, 0.0, 0.0, 0.0],
    "centre_base": [ALONG[0], ALONG[1], 0.015],
    "target": {"x": 0.4, "y": -0.1, "theta": 0.0},
}
PNG = png16()
FLAT = np.full((160, 160), 0.8, np.float32)


def placing(**changed: Any) -> bytes:
    return json.dumps(PLACE | changed).encode()


def pose(*quat: float) -> np.ndarray:
    return np.array([*ARRAYS["T_base_camera"][:3], *quat])


def camera(**changed: float) -> np.ndarray:
    places = {"fx": (0, 0), "fy": (1, 1), "cx": (0, 2), "skew": (0, 1), "below": (1, 0), "last": (2, 2)}
    matrix = FRAME.intrinsics.copy()
    for name, value in changed.items():
        matrix[places[name]] = value
    return matrix


def changed(body: bytes, place: int) -> bytes:
    return body[:place] + bytes([body[place] ^ 255]) + body[place + 1 :]


def b64(data: bytes) -> str:
    return base64.b64encode(data).decode()


WRONG: dict[str, tuple[str, bytes, str, int, str]] = {
    # name: path, body, content type, status, part of the message
    "no body": ("/plan", b"", JSON, 400, "invalid json"),
    "no json": ("/plan", b"{depth: 1}", JSON, 400, "invalid json"),
    "not utf-8": ("/plan", b'{"depth_png": "\xff\xfe"}', JSON, 400, "invalid"),
    "json that is cut off": ("/plan", text()[:-30], JSON, 400, "invalid json"),
    "a list": ("/plan", b"[]", JSON, 400, "object"),
    "a number": ("/plan", b"7", JSON, 400, "object"),
    "null": ("/plan", b"null", JSON, 400, "object"),
    "nesting": ("/plan", b"[" * 10_000, JSON, 400, "invalid json"),
    "many values": ("/score", b"[0," * 100_000, JSON, 413, "more values than 4096 grasps"),
    "no image": ("/plan", text(depth_png=None), JSON, 400, "depth_png is missing"),
    "no intrinsics": ("/plan", text(intrinsics=None), JSON, 400, "intrinsics: field required"),
    "no pose": ("/plan", text(T_base_camera=None), JSON, 400, "T_base_camera: field required"),
    "an unknown field": ("/plan", text(path="/etc/passwd"), JSON, 400, "path: extra inputs"),
    "another type": ("/plan", text(seed="1; reboot"), JSON, 400, "seed: input should be a valid integer"),
    "a negative seed": ("/plan", text(seed=-1), JSON, 400, "seed: input should be greater"),
    "a huge seed": ("/plan", text(seed=10**30), JSON, 400, "seed"),
    "too many alternatives": ("/plan", text(alternatives=1000), JSON, 400, "less than or equal to 100"),
    "an image that is no base64": ("/plan", text(depth_png="*" * 40), JSON, 400, "not base64"),
    "an image that is no png": ("/plan", text(depth_png=b64(b"BM" + bytes(99))), JSON, 400, "no PNG image"),
    "a png that is cut off": ("/plan", text(depth_png=b64(PNG[:-9])), JSON, 400, "cut off or damaged"),
    "a scale of zero": ("/plan", text(depth_scale=0), JSON, 400, "depth_scale: input should be greater"),
    "infinity in json": (
        "/plan", text().replace(b"365.5", b"Infinity", 1), JSON, 400, "finite number",
    ),
    "nan in json": ("/plan", text().replace(b"365.5", b"NaN", 1), JSON, 400, "finite number"),
    "grasps for a plan": ("/plan", text(grasps=[ALONG]), JSON, 400, "grasps: extra inputs"),
    "no grasps": ("/score", text(), JSON, 400, "grasps: field required"),
    "an empty list of grasps": ("/score", text(grasps=[]), JSON, 400, "at least 1 item"),
    "a grasp of three": ("/score", text(grasps=[[0.5, 0.0, 0.02]]), JSON, 400, "grasps.0.3: field required"),
    "a grasp out of reach": ("/score", text(grasps=[[50.0, 0, 0, 0]]), JSON, 400, "grasps.0.0: input should"),
    "a grasp of a whole turn": ("/score", text(grasps=[[0.5, 0, 0.02, 3.1]]), JSON, 400, "grasps.0.3"),
    "too many grasps": ("/score", npz(grasps=np.zeros((4100, 4))), NPZ, 413, "16400 numbers, at most 16384"),
    "no npz": ("/plan", b"PK\x03\x04" + bytes(50), NPZ, 400, "npz file is damaged"),
    "an empty npz": ("/plan", b"", NPZ, 400, "npz file is damaged"),
    "an npz that is cut off": ("/plan", npz()[:-100], NPZ, 400, "npz file is damaged"),
    "an npz with a changed byte": (
        "/plan", changed(npz(), 300), NPZ, 400, "damaged",
    ),
    "an npz with a changed directory": ("/plan", npz()[:-6] + b"\xff\xff\xff\xfe\0\0", NPZ, 400, "damaged"),
    "an npz without depth": ("/plan", npz(depth=None), NPZ, 400, "no array depth"),
    "an npz with another array": ("/plan", npz(colour=np.zeros(3)), NPZ, 400, "'colour'; legal: "),
    "objects": ("/plan", npz(depth=np.array([[{}]], dtype=object)), NPZ, 400, "holds object"),
    "text": ("/plan", npz(depth=np.array([["a"]])), NPZ, 400, "holds <U1"),
    "complex numbers": ("/plan", npz(depth=FLAT.astype(complex)), NPZ, 400, "holds complex128"),
    "half precision": ("/plan", npz(depth=FLAT.astype(np.float16)), NPZ, 400, "holds float16"),
    "a query": ("/plan?seed=1", text(), JSON, 400, "send them in the body"),
    "a bomb": ("/plan", npz(depth=np.zeros((9000, 9000), np.float32)), NPZ, 413, "bytes unpacked, at most"),
    "a row": ("/plan", npz(depth=FLAT[0]), NPZ, 400, "depth has shape (160,)"),
    "a stack": ("/plan", npz(depth=FLAT[None]), NPZ, 400, "two dimensions at most"),
    "a strip": ("/plan", npz(depth=np.ones((1, 4000), np.float32)), NPZ, 413, "1 x 4000 pixels, at most"),
    "a stamp": ("/plan", npz(depth=FLAT[:8, :8]), NPZ, 400, "8 x 8 pixels, at least 16"),
    "no pixels": ("/plan", npz(depth=FLAT[:0]), NPZ, 400, "shape (0, 160)"),
    "millimetres": ("/plan", npz(depth=1e3 * FLAT), NPZ, 400, "over 20 m"),
    "infinite depth": ("/plan", npz(depth=FLAT + np.inf), NPZ, 400, "infinite or negative"),
    "negative depth": ("/plan", npz(depth=-FLAT), NPZ, 400, "infinite or negative"),
    "nothing but invalid": ("/plan", npz(depth=FLAT + np.nan), NPZ, 422, "no valid pixel"),
    "a scale of metres": ("/plan", npz(depth_scale=1e-3), NPZ, 400, "depth_scale is for images of integers"),
    "a short quaternion": ("/plan", npz(T_base_camera=pose(0, 0.9, 0, 0)), NPZ, 400, "length 0.9"),
    "no quaternion": ("/plan", npz(T_base_camera=pose(0, 0, 0, 0)), NPZ, 400, "length 0;"),
    "nan in a pose": ("/plan", npz(T_base_camera=pose(np.nan, 1, 0, 0)), NPZ, 400, "finite number"),
    "a camera far away": ("/plan", npz(T_base_camera=[0, 0, 80, 0, 1, 0, 0]), NPZ, 400, "T_base_camera.2"),
    "a camera that looks up": ("/plan", npz(T_base_camera=pose(1, 0, 0, 0)), NPZ, 422, ""),
    "a short focal length": ("/plan", npz(intrinsics=camera(fx=1.0)), NPZ, 400, "intrinsics are not those"),
    "a negative focal length": ("/plan", npz(intrinsics=camera(fy=-365.0)), NPZ, 400, "intrinsics are not"),
    "a centre elsewhere": ("/plan", npz(intrinsics=camera(cx=1e4)), NPZ, 400, "intrinsics are not those"),
    "a skewed camera": ("/plan", npz(intrinsics=camera(skew=50.0)), NPZ, 400, "intrinsics are not those"),
    "no pinhole matrix": ("/plan", npz(intrinsics=camera(last=2.0)), NPZ, 400, "intrinsics are not those"),
    "a matrix of 2 x 2": ("/plan", npz(intrinsics=np.eye(2)), NPZ, 400, "intrinsics"),
    "an empty table": ("/plan", npz(depth=FLAT), NPZ, 422, "nothing rises more than 2 mm"),
    "an empty table to score": ("/score", npz(depth=FLAT, grasps=[ALONG]), NPZ, 422, "nothing rises"),
    "a form": ("/plan", b"depth=1", "application/x-www-form-urlencoded", 415, "legal: application/json"),
    "plain text": ("/plan", text(), "text/plain", 415, "legal: application/json"),
    "npz to place": ("/place", npz(), NPZ, 415, "legal: application/json"),
    "a place without target": ("/place", placing(target=None), JSON, 400, "target: input should be"),
    "a target elsewhere": ("/place", placing(target={"x": 1e9, "y": 0, "theta": 0}), JSON, 400, "target.x"),
    "a target with more": ("/place", placing(target=PLACE["target"] | {"z": 1}), JSON, 400, "target.z"),
    "a long displacement": ("/place", placing(displacement=[9, 0, 0, 0]), JSON, 400, "displacement.0"),
    "a long place": (
        "/place", placing() + b" " * 20_000, JSON, 413, "more than 10000 bytes; send only grasp, displ",
    ),
    "too large": ("/plan", bytes(int(BODY_MB * 1e6) + 1), NPZ, 413, "more than 1000000 bytes"),
    "an unknown path": ("/plans", text(), JSON, 404, "legal: POST /plan"),
    "a path with a slash": ("/plan/", text(), JSON, 404, "POST /plan/: not found; legal: POST /plan"),
    "a path upwards": ("/../../etc/passwd", text(), JSON, 404, "not found"),
    "a page of documentation": ("/docs", text(), JSON, 404, "not found"),
    "the wrong method": ("/health", text(), JSON, 405, "method not allowed"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_request_is_one_line_and_the_server_lives_on(served: Server, name: str):
    path, body, content_type, status, message = WRONG[name]
    workers = served.workers
    found, answer = served.client.ask(path, body, content_type)
    assert (found, set(answer)) == (status, {"error"}), answer
    assert message in answer["error"] and "\n" not in answer["error"]
    assert served.workers == workers and len(workers) == 1


def test_a_body_without_a_length_is_limited_too(served: Server):
    connection = http.client.HTTPConnection("127.0.0.1", served.client.port, timeout=60)
    chunks = (bytes(100_000) for _ in range(12))
    connection.request("POST", "/plan", chunks, {"Content-Type": NPZ}, encode_chunked=True)
    answer = connection.getresponse()
    assert answer.status == 413 and b"more than 1000000 bytes" in answer.read()
    connection.close()


@pytest.mark.parametrize(
    "sent",
    [b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00", b"GET / HTTP/9.9\r\n\r\n", b"A" * 200_000,
     b"POST /plan HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
     b"POST /plan HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\nX"],
    ids=("short", "tls", "version", "long", "length", "both"),
)  # fmt: skip
def test_what_is_no_http_is_refused_or_cut_off(served: Server, sent: bytes):
    with socket.create_connection(("127.0.0.1", served.client.port), timeout=20) as client:
        try:
            client.sendall(sent)
            client.shutdown(socket.SHUT_WR)
            answer = client.recv(100)
        except OSError:  # cut off while this is still being sent
            answer = b""
    assert answer == b"" or answer.startswith(b"HTTP/1.1 4")
    assert served.client.ask("/health")[0] == 200


def test_a_name_that_leads_here_from_elsewhere_is_refused(served: Server):
    status, answer = served.client.ask("/health", Host="evil.example.org")
    assert status == 400 and "127.0.0.1 or localhost" in answer["error"]


def test_both_forms_are_planned_scored_and_placed(served: Server):
    for body, content_type in ((npz(seed=2), NPZ), (text(seed=2), JSON)):
        status, plan = served.client.ask("/plan", body, content_type)
        assert status == 200 and plan["quality"] > 0.9 and len(plan["alternatives"]) > 3
        fields = {"grasp": plan["grasp"], "displacement": plan["displacement"]}
        fields |= {"centre_base": plan["part"]["centre_base"], "target": PLACE["target"]}
        status, placed = served.client.ask("/place", json.dumps(fields).encode())
        # The hand stands beside the target by as much as it stood beside the centre, about.
        away = np.hypot(*np.subtract(plan["grasp"], plan["part"]["centre_base"] + [0])[:2])
        there = np.hypot(*np.subtract(placed["hand"][:2], [0.4, -0.1]))
        assert status == 200 and abs(there - away) < 0.01
    status, scored = served.client.ask("/score", npz(grasps=[ALONG, plan["grasp"]]), NPZ)
    assert status == 200 and [one["quality"] > 0.9 for one in scored["grasps"]] == [True, True]


def test_the_same_request_has_the_same_answer(served: Server):
    first, again, other = (served.client.ask("/plan", npz(seed=seed), NPZ)[1] for seed in (1, 1, 2))
    for answer in (first, again):
        del answer["seconds"]
    assert first == again and first["grasp"] != other["grasp"]


def test_health_and_models_say_what_runs_and_no_path(served: Server):
    assert served.client.ask("/health") == (
        200, {"status": "ok", "workers": 1, "working": 1, "requests": 0},
    )  # fmt: skip
    status, about = served.client.ask("/models")
    assert status == 200 and about["models"][0]["name"] == "pretrained"
    assert about["table"]["table_z"] == 0 and about["planner"]["min_quality"] == 0.5
    assert "/" not in json.dumps(about).replace("m/s", "")


def test_the_schema_names_every_path_and_loads_nothing_from_elsewhere(served: Server):
    status, schema = served.client.ask("/openapi.json")
    assert status == 200 and set(schema["paths"]) == {"/plan", "/score", "/place", "/health", "/models"}
    assert "http" not in json.dumps(schema)
    assert set(values()) <= set(
        schema["paths"]["/plan"]["post"]["requestBody"]["content"][JSON]["schema"]["properties"]
    )
