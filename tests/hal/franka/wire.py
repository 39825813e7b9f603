"""Messages of the Franka Control Interface, server version 5, little endian and packed."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mskgrasp.core.grasp import PAD_REACH

STATE = struct.Struct("<Q 96d d9d3d d9d3d 2d2d 56d 7d6d7d6d 7d6d6d6d3d 2d2d2d 16d6d6d 7d7d B B 41? 41? B d")
GRIPPER_STATE = struct.Struct("<Idd?H")
assert STATE.size == 2373 and GRIPPER_STATE.size == 23
_EYE = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_ZEROS = (0.0,) * 33
_NO_ERRORS = (False,) * 41
_STIFFNESS = 2e4
"""Stiffness of a table, N/m."""


@dataclass(kw_only=True)
class RobotState:
    """What a tick of the robot tells; the rest of the message is zero.

    A load is as the client states it: mass, centre (3,), inertia (9,). Poses are column-major (16,).
    Packed a thousand times a second, hence without arrays.
    """

    tick: int
    pose: Sequence[float]
    f_t_ee: Sequence[float]
    q: Sequence[float]
    dq: Sequence[float]
    torque: Sequence[float]
    generator: int
    controller: int
    mode: int
    reflexes: tuple[int, ...]
    pushed_up: float = 0.0
    ee_mass: float = 0.73
    load: tuple[float, ...] = (0.0,) * 13

    def pack(self) -> bytes:
        pose, tool = self.pose, self.f_t_ee
        return STATE.pack(
            self.tick,
            *(*pose, *pose, *tool, *_EYE, *tool, *_EYE),
            # The Franka Hand's mass, inertia and centre as Desk has them; then the load's.
            *(self.ee_mass, 0.001, 0, 0, 0, 0.0025, 0, 0, 0, 0.0017, -0.01, 0.0, 0.03),
            *(self.load[0], *self.load[4:], *self.load[1:4], *_ZEROS[:4]),
            # The client limits the change of its torques against the last that it finds here.
            *(*self.torque, *self.torque, *_ZEROS[:7], *self.q, *self.q, *self.dq, *_ZEROS[:14]),
            *(*_ZEROS[:33], 0.0, 0.0, self.pushed_up, 0.0, 0.0, 0.0, *_ZEROS[:21]),
            *(*pose, *_ZEROS[:12], *self.q, *_ZEROS[:7]),
            *(self.generator, self.controller, *_NO_ERRORS),
            *(_NO_ERRORS if not self.reflexes else [k in self.reflexes for k in range(41)]),
            *(self.mode, 1.0),
        )


@dataclass(frozen=True, kw_only=True)
class Table:
    """A springy table under the hand, a plane z + slope_x x: it is felt, and does not hold the hand."""

    z: float
    slope_x: float = 0.0

    def push(self, x: float, z: float) -> float:
        """Force on the pads of a hand that points down with its TCP there, N."""
        return max(0.0, _STIFFNESS * (self.z + self.slope_x * x - (z - PAD_REACH)))


@dataclass(frozen=True, kw_only=True)
class GripperState:
    """What a tick of the hand tells."""

    tick: int
    width: float
    max_width: float
    grasped: bool

    def pack(self) -> bytes:
        return GRIPPER_STATE.pack(self.tick, self.width, self.max_width, self.grasped, 30)


def ask_for_priority() -> None:
    """A robot's control has a processor for itself; here it goes first, where the system lets it.

    libfranka takes a second without a state for a lost link.
    """
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, -5)


class Channel:
    """One client at a time on a TCP port, and its UDP port; a second one waits for ever, as on a robot.

    Attributes:
        left: The client has closed since this was last set to False.
    """

    def __init__(self, host: str, port: int, header: str):
        self._header = struct.Struct(header)
        self._listener: socket.socket | None = socket.create_server((host, port), backlog=1)
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._udp: socket.socket | None = None
        self._peer = ""
        self._buffer = b""
        self.left = False

    def requests(self) -> Iterator[tuple[int, int, bytes]]:
        """Command, number and payload of every whole message that has come."""
        if self._client is None and self._listener is not None:
            with contextlib.suppress(BlockingIOError):
                self._client, (self._peer, _) = self._listener.accept()
                self._client.setblocking(False)
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._buffer = b""
        if self._client is None:
            return
        try:
            data = self._client.recv(65536)
            if not data:
                self._hang_up()
                return
            self._buffer += data
        except BlockingIOError:
            pass
        except ConnectionError:
            self._hang_up()
            return
        while len(self._buffer) >= self._header.size:
            command, number, size = self._header.unpack_from(self._buffer)
            if len(self._buffer) < size:
                return
            message, self._buffer = self._buffer[:size], self._buffer[size:]
            yield command, number, message[self._header.size :]

    def datagrams(self) -> Iterator[bytes]:
        """What has come by UDP."""
        while self._udp is not None:
            try:
                yield self._udp.recv(4096)
            except (BlockingIOError, ConnectionError):
                return

    def reply(self, command: int, number: int, payload: bytes) -> None:
        """Answers a message."""
        if self._client is None:
            return
        message = self._header.pack(command, number, self._header.size + len(payload)) + payload
        self._client.setblocking(True)
        with contextlib.suppress(ConnectionError):
            self._client.sendall(message)
        self._client.setblocking(False)

    def open_udp(self, port: int) -> None:
        """Sends states to this port of the client from now on."""
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.connect((self._peer, port))
        self._udp.setblocking(False)

    def send_state(self, message: bytes) -> None:
        """Sends a datagram to the client, if there is one."""
        if self._udp is not None:
            with contextlib.suppress(BlockingIOError, ConnectionError):
                self._udp.send(message)

    def wait_for_datagram(self, timeout_s: float) -> None:
        """Returns when something has come by UDP."""
        if self._udp is not None:
            select.select([self._udp], [], [], timeout_s)

    def refuse(self) -> None:
        """Accepts no client any more, as where nothing listens on the port."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def _hang_up(self) -> None:
        for one in (self._client, self._udp):
            if one is not None:
                one.close()
        self._client = self._udp = None
        self.left = True
