"""Who may connect to the page."""

from __future__ import annotations

import http.client
import socket

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from mskgrasp.core.errors import UsageError
from mskgrasp.view.page import Page
from mskgrasp.view.page_server import PageServer, may_connect, require_local


def test_an_address_that_others_reach_is_refused_with_the_reason_unless_it_is_allowed():
    with pytest.raises(UsageError, match=r"this page can move an arm.* or give --allow-remote"):
        require_local("0.0.0.0", allow_remote=False)
    require_local("0.0.0.0", allow_remote=True)
    require_local("127.0.0.1", allow_remote=False)


@pytest.mark.parametrize(
    ("host", "origin", "local", "may"),
    [
        ("127.0.0.1:8080", None, True, True),
        ("localhost:9000", "http://localhost:9000", True, True),  # a forwarded port
        ("[::1]:8080", "http://[::1]:8080", True, True),
        ("localhost:8080", "http://evil.example", True, False),
        ("localhost:8080", "http://localhost:3000", True, False),  # another page of this machine
        ("localhost:8080", "null", True, False),
        ("evil.example:8080", "http://evil.example:8080", True, False),  # resolved to 127.0.0.1
        ("evil.example:8080", None, True, False),
        ("", None, True, False),
        ("cell.example:8080", "http://cell.example:8080", False, True),
        ("cell.example:8080", "http://evil.example", False, False),
    ],
)
def test_only_the_page_itself_connects(host: str, origin: str | None, local: bool, may: bool):
    assert may_connect(host, origin, local=local) is may


def test_a_web_socket_of_another_page_is_refused_and_that_of_the_page_is_not(page: Page):
    port = page.server.get_port()
    url, version = f"ws://127.0.0.1:{port}", [Subprotocol(f"viser-v{viser.__version__}")]
    with pytest.raises(InvalidStatus, match="403"):
        connect(url, origin=Origin("http://evil.example"), subprotocols=version)
    with connect(url, origin=Origin(f"http://127.0.0.1:{port}"), subprotocols=version) as own:
        assert own.recv(timeout=20)


@pytest.mark.parametrize(("host", "status"), [("evil.example", 403), ("localhost", 200)])
def test_the_page_is_served_under_local_names_alone(page: Page, host: str, status: int):
    client = http.client.HTTPConnection("127.0.0.1", page.server.get_port(), timeout=20)
    client.request("GET", "/", headers={"Host": host})
    assert client.getresponse().status == status
    client.close()


def test_no_client_can_have_the_page_shared_over_the_internet(page: Page, monkeypatch):
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *_: pytest.fail("a tunnel was opened"))
    assert page.server.request_share_url() is None


def test_an_address_that_is_taken_is_refused_and_no_other_port_is_tried():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(UsageError, match="already in use; choose another --port"):
            PageServer("127.0.0.1", taken.getsockname()[1], "test")
