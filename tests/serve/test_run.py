"""Start and end of the server."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadConfig, BadModel, UsageError
from mskgrasp.core.grasp import HAND_GEOMETRY
from mskgrasp.core.settings import REGION
from mskgrasp.serve import run
from mskgrasp.serve.__main__ import main
from mskgrasp.serve.config import ServeConfig
from mskgrasp.serve.run import planner_settings, read_token
from tests.programs import run_here
from tests.serve.bodies import NPZ, Client, npz
from tests.serve.conftest import server

TOKEN = "a-token-of-some-length"


def test_another_address_needs_a_token():
    ended = run_here(main, "--host", "0.0.0.0")
    assert ended.returncode == 2 and ended.stderr.count("\n") == 1
    assert "--host 0.0.0.0 can be reached from other machines and needs --token-file" in ended.stderr


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "No such file"), (b"short", "one word of 16"), (b"two words of length", "one word of 16"),
     (b"\xff" * 20, "not ASCII"), (b"", "one word of 16"), (b"with\x00control-characters", "one word of 16")],
)  # fmt: skip
def test_a_token_that_cannot_be_used_is_refused(tmp_path: Path, content: bytes | None, message: str):
    path = tmp_path / "token"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError, match=message):
        read_token(ServeConfig(token_file=path))


def test_a_token_that_others_can_read_is_reported(tmp_path: Path, capsys):
    path = tmp_path / "token"
    path.write_text(TOKEN + "\n")
    path.chmod(0o644)
    assert read_token(ServeConfig(token_file=path, host="0.0.0.0")) == TOKEN
    assert "chmod 600" in capsys.readouterr().err
    path.chmod(0o600)
    assert read_token(ServeConfig(token_file=path)) == TOKEN
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--models", "nowhere"), "no model.json in nowhere"),
        (("--cell", "nowhere.yaml"), "cannot read configuration nowhere.yaml"),
        (
            ("--host", "no.such.host.invalid", "--token-file", "token"),
            "cannot listen on no.such.host.invalid",
        ),
    ],
)
def test_what_does_not_exist_is_one_line_and_exit_code_2(
    tmp_path: Path, monkeypatch, arguments: tuple[str, ...], message: str
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "token").write_text(TOKEN)
    (tmp_path / "token").chmod(0o600)
    ended = run_here(main, "--port", "0", *arguments)
    assert ended.returncode == 2 and message in ended.stderr and ended.stderr.count("\n") == 1


@pytest.mark.parametrize("package", ["fastapi", "uvicorn"])
def test_a_missing_extra_is_one_line_with_the_remedy(monkeypatch, package: str):
    monkeypatch.setitem(sys.modules, package, None)
    ended = run_here(main)
    assert ended.returncode == 2 and "EXTRAS=dev,serve .ci/setup" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_a_model_of_another_hand_is_refused_before_anything_starts(monkeypatch):
    monkeypatch.setattr(run, "HAND_GEOMETRY", HAND_GEOMETRY | {"max_opening": 0.2})
    with pytest.raises(BadModel, match="trained for another hand"):
        planner_settings(ServeConfig())


def test_the_table_is_that_of_the_cell_or_of_the_simulated_one(tmp_path: Path):
    assert planner_settings(ServeConfig()).workspace.region == REGION
    example = Path(__file__).parents[2] / "configs" / "cells" / "panda_kinect2.yaml"
    text = example.read_text(encoding="utf-8")
    with pytest.raises(BadConfig, match="run hal.touch"):
        planner_settings(ServeConfig(cell=example))
    assert "table_z: null" in text
    measured = tmp_path / "cell.yaml"
    measured.write_text(text.replace("table_z: null", "table_z: -0.0123"))
    table = planner_settings(ServeConfig(cell=measured)).workspace
    assert table.table_z == -0.0123
    assert table.lowest_grasp_z(np.array([0.5, 0.0])) > table.table_z + 0.0095


@pytest.mark.slow
def test_with_a_token_and_little_time_a_server_answers_those_who_have_it_and_are_quick(tmp_path: Path):
    path = tmp_path / "token"
    path.write_text(TOKEN)
    path.chmod(0o600)
    with server("--token-file", str(path), "--timeout-s", "1.5", token=TOKEN) as served:
        stranger = Client(served.client.port)
        assert stranger.ask("/health")[0] == 200
        for path, body in (("/models", None), ("/plan", npz()), ("/place", b"{}"), ("/openapi.json", None)):
            assert stranger.ask(path, body, NPZ)[0] == 401
        assert Client(served.client.port, TOKEN + "x").ask("/models")[0] == 401
        status, about = served.client.ask("/models")
        assert status == 200 and TOKEN not in str(about)
        assert TOKEN.encode() not in Path(f"/proc/{served.pid}/cmdline").read_bytes()
        # A body that does not come.
        with socket.create_connection(("127.0.0.1", served.client.port), timeout=20) as slow:
            head = (
                f"POST /plan HTTP/1.1\r\nHost: a\r\nAuthorization: Bearer {TOKEN}\r\nContent-Type: {NPZ}\r\n"
            )
            slow.sendall(f"{head}Content-Length: 1000\r\n\r\nPK".encode())
            began = time.monotonic()
            assert b" 408 " in slow.recv(100) and time.monotonic() - began < 10
        # A worker that does not answer, and is ended.
        (worker,) = served.workers
        os.kill(worker, signal.SIGSTOP)
        status, answer = served.client.ask("/plan", npz(), NPZ)
        assert status == 503 and "1.5 s" in answer["error"]
