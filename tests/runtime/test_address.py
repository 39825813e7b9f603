"""Addresses that programs listen on."""

from __future__ import annotations

import socket

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.address import is_local, listening, name_of


@pytest.mark.parametrize(
    ("host", "local"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True), ("0.0.0.0", False),
     ("::", False), ("192.168.1.2", False), ("localhost.example.org", False), ("", False)],
)  # fmt: skip
def test_only_loopback_addresses_are_local(host: str, local: bool):
    assert is_local(host) is local


@pytest.mark.parametrize(
    ("host", "name"),
    [("127.0.0.1:8080", "127.0.0.1"), ("LOCALHOST", "localhost"), ("[::1]:80", "::1"), ("", "")],
)
def test_a_name_is_read_without_its_port(host: str, name: str):
    assert name_of(host) == name


@pytest.mark.parametrize("host", ["a..b", "a" * 64 + ".b", "no.such.host.invalid"])
def test_what_is_no_host_is_refused(host: str):
    with pytest.raises(UsageError, match=f"cannot listen on {host}: .*; choose another --host"):
        listening(host, 0)


def test_an_address_that_is_taken_is_refused():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(UsageError, match="already in use; choose another --port"):
            listening("127.0.0.1", taken.getsockname()[1])
