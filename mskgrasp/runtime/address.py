"""Addresses that programs listen on: reserved, local or not, and the names that clients use."""

from __future__ import annotations

import ipaddress
import socket

from mskgrasp.core.errors import UsageError


def is_local(host: str) -> bool:
    """Whether an address can be reached from this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def name_of(host: str) -> str:
    """The name in a header ``Host``, without the port."""
    return (host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]).lower()


def listening(host: str, port: int) -> socket.socket:
    """Reserve an address; nobody can connect until the socket listens.

    Raises:
        UsageError: It is taken, or is not an address of this machine.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError) as error:  # a label of a name that is empty or too long
        reason = getattr(error, "strerror", None) or "it is no name of a host"
        raise UsageError(f"cannot listen on {host}: {reason}; choose another --host") from error
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except OSError as error:
        listener.close()
        raise UsageError(
            f"cannot listen on {host} port {port}: {error.strerror}; choose another --port or --host"
        ) from error
    return listener
