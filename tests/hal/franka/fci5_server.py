"""A Panda's control, as libfranka 0.9.2 sees it: ``python -m tests.hal.franka.fci5_server HOST MODEL``.

Server version 5 of the Franka Control Interface (TCP 1337 and 1338, UDP at 1 kHz) with seven joints that
have inertia and dry friction, and a hand that can hold a part. Written from the layouts of the messages, for
the tests: it knows external torque control alone, which is what panda_py uses. MODEL is the shared object
that the client loads for its dynamics. Faults are commanded on standard input, one a line:

    reflex | reflex_at_end (of the next motion) | user_stop | user_release | part WIDTH |
    answer ok|unsuccessful|fail|aborted | unhomed | flange | no_hand (its server refuses clients) |
    table Z SLOPE (a table that pushes the hand up) | hand KG (the end effector's mass in Desk) |
    fingers M (opening to that width, once homed) | load (answers with what was set) |
    thresholds (answers with those of the reflex that the client has set: torque and force) | q (answers
    with the joints) | clock (answers with the robot's time, s)
"""

from __future__ import annotations

import math
import selectors
import struct
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hal.franka.driver import column_major
from hal.franka.frames import F_T_EE
from mskgrasp.core.panda_kinematics import forward
from tests.hal.franka.wire import Channel, GripperState, RobotState, Table, ask_for_priority

VERSION, GRIPPER_VERSION = 5, 3
CONNECT, MOVE, STOP_MOVE, SET_THRESHOLDS, SET_LOAD, RECOVER, LOAD_MODEL = 0, 1, 2, 4, 10, 12, 13
IDLE, MOVING, REFLEX, USER_STOPPED = 1, 2, 4, 5
READY = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398]
INERTIA = [1.0, 1.0, 1.0, 1.0, 0.3, 0.2, 0.1]
FRICTION = [0.5, 0.5, 0.5, 0.5, 0.2, 0.2, 0.2]
"""N m of dry friction: leaves the impedance controller up to 4 mrad short of its goal."""
COMMAND = struct.Struct("<Q 7d7d16d6d2d ?? 7d")
TICK = 1e-3
TURN_S = 3e-4
ANSWERS = {"ok": 0, "fail": 1, "unsuccessful": 2, "aborted": 3}


def pose_of(joints: Sequence[float]) -> list[float]:
    """(16,) of the end effector in the base, column-major."""
    return column_major(forward(np.array(joints))[0])


def speed_after(speed: float, torque: float, friction: float, inertia: float) -> float:
    """Of a joint a tick later, rad/s; friction stops it and does not turn it round."""
    held = torque if speed == 0 else math.copysign(friction, speed)
    after = speed + (torque - min(max(held, -friction), friction)) / inertia * TICK
    return 0.0 if after * speed < 0 else after


@dataclass
class Robot:
    """Joints and the motion in progress."""

    model: bytes
    channel: Channel
    version: int = VERSION
    q: Sequence[float] = field(default_factory=READY.copy)
    dq: Sequence[float] = (0.0,) * 7
    torque: Sequence[float] = (0.0,) * 7
    mode: int = IDLE
    motion: int = 0
    generator: int = 0
    controller: int = 3
    reflexes: tuple[int, ...] = ()
    reflex_at_end: bool = False
    answered: bool = False
    tick: int = 0
    stale: bool = False
    pose: Sequence[float] = field(default_factory=lambda: pose_of(READY))
    f_t_ee: Sequence[float] = field(default_factory=lambda: column_major(F_T_EE))
    table: Table | None = None
    ee_mass: float = 0.73
    load: tuple[float, ...] = (0.0,) * 13
    thresholds: tuple[float, ...] = ()

    def step(self) -> None:
        self.tick += 1
        for command, number, payload in self.channel.requests():
            self.handle(command, number, payload)
        for data in self.channel.datagrams():
            self.command(data)
        if self.channel.left:
            self.channel.left = False
            self.thresholds = ()
            self.finish(None, IDLE if self.mode == MOVING else self.mode)
        if any(self.torque) or any(self.dq):
            self.dq = [*map(speed_after, self.dq, self.torque, FRICTION, INERTIA)]
            self.q = [q + dq * TICK for q, dq in zip(self.q, self.dq, strict=True)]
            self.stale = True
        if self.tick % 5 == 0 and self.stale:
            self.pose, self.stale = pose_of(self.q), False
        self.channel.send_state(
            RobotState(
                tick=self.tick,
                pose=self.pose,
                f_t_ee=self.f_t_ee,
                q=self.q,
                dq=self.dq,
                torque=self.torque,
                generator=self.generator,
                controller=self.controller,
                mode=self.mode,
                reflexes=self.reflexes,
                pushed_up=0.0 if self.table is None else self.table.push(self.pose[12], self.pose[14]),
                ee_mass=self.ee_mass,
                load=self.load,
            ).pack()
        )

    def handle(self, command: int, number: int, payload: bytes) -> None:
        reply = self.channel.reply
        if command == CONNECT:
            version, port = struct.unpack("<HH", payload)
            reply(command, number, struct.pack("<BH", int(version != self.version), self.version))
            self.channel.open_udp(port)
        elif command == MOVE:
            controller, generator = struct.unpack("<II", payload[:8])
            if self.mode != IDLE:
                reply(command, number, b"\x04")  # rejected in this mode
                return
            self.motion, self.mode = number, MOVING
            self.controller, self.generator = controller, generator + 1
            reply(command, number, b"\x01")
        elif command == STOP_MOVE:
            self.finish(2, IDLE if self.mode == MOVING else self.mode)
            reply(command, number, b"\x00")
        elif command == RECOVER:
            if self.mode == REFLEX:
                self.mode, self.reflexes = IDLE, ()
            reply(command, number, b"\x00")
        elif command in (SET_LOAD, SET_THRESHOLDS) and self.mode != IDLE:
            reply(command, number, b"\x01")  # not possible in this mode
        elif command == SET_LOAD:
            self.load = struct.unpack("<d3d9d", payload)
            reply(command, number, b"\x00")
        elif command == SET_THRESHOLDS:
            values = struct.unpack("<52d", payload)
            self.thresholds = (values[0], values[-1])
            reply(command, number, b"\x00")
        elif command == LOAD_MODEL:
            reply(command, number, b"\x00" + self.model)
        else:
            reply(command, number, b"\x00")

    def command(self, data: bytes) -> None:
        if len(data) != COMMAND.size or not self.motion:
            return
        self.answered = True
        values = COMMAND.unpack(data)
        if values[40] and self.reflex_at_end:  # motion_generation_finished
            self.reflex_at_end = False
            self.fault(["reflex"])
        elif values[40]:
            self.finish(0, IDLE)
        else:
            self.torque = values[41:48]

    def finish(self, status: int | None, mode: int) -> None:
        """Ends the motion, if there is one, with its status; the brakes hold."""
        if self.motion and status is not None:
            self.channel.reply(MOVE, self.motion, bytes([status]))
        self.motion, self.mode, self.generator, self.controller = 0, mode, 0, 3
        self.answered = False
        self.torque = self.dq = (0.0,) * 7

    def fault(self, words: list[str]) -> None:
        match words[0]:
            case "reflex":
                self.reflexes = (7,)  # cartesian_reflex
                self.finish(6, REFLEX)
            case "reflex_at_end":
                self.reflex_at_end = True
            case "user_stop":
                self.finish(2, USER_STOPPED)
            case "user_release":
                self.mode = IDLE
            case "table":
                self.table = Table(z=float(words[1]), slope_x=float(words[2]))
            case "hand":
                self.ee_mass = float(words[1])
            case "flange":
                self.f_t_ee = column_major(np.eye(4))  # no end effector is chosen in Desk


@dataclass
class Hand:
    """Fingers between 0 and 80 mm, and what is between them."""

    channel: Channel
    width: float = 0.06
    max_width: float = 0.08
    goal: float = 0.06
    speed: float = 0.1
    part: float = 0.0
    answer: str = "ok"
    pending: tuple[int, int, float] | None = None
    grasped: bool = False
    homed_width: float = 0.0797
    tick: int = 0

    def step(self) -> None:
        self.tick += 1
        for command, number, payload in self.channel.requests():
            self.handle(command, number, payload)
        self.channel.left = False
        closed = max(self.goal, self.part)
        self.width += min(max(closed - self.width, -self.speed * TICK), self.speed * TICK)
        if self.pending is not None and abs(self.width - closed) < 1e-6:
            command, number, _ = self.pending
            self.pending = None
            if command == 1:
                self.max_width = self.homed_width
            status = ANSWERS[self.answer] if command == 2 else 0
            self.grasped = command == 2 and status == 0
            if command == 2 and status != 0:
                self.goal = self.width
            self.channel.reply(command, number, struct.pack("<H", status))
        if self.tick % 5 == 0:
            self.channel.send_state(
                GripperState(
                    tick=self.tick, width=self.width, max_width=self.max_width, grasped=self.grasped
                ).pack()
            )

    def handle(self, command: int, number: int, payload: bytes) -> None:
        if command == 0:
            _, port = struct.unpack("<HH", payload)
            self.channel.reply(command, number, struct.pack("<HH", 0, GRIPPER_VERSION))
            self.channel.open_udp(port)
            return
        if self.pending is not None:
            old, owed, _ = self.pending
            self.channel.reply(old, owed, struct.pack("<H", ANSWERS["aborted"]))
            self.pending = None
        if command == 4:
            self.goal = self.width
            self.channel.reply(command, number, struct.pack("<H", 0))
            return
        if command in (2, 3) and self.max_width == 0:
            self.channel.reply(command, number, struct.pack("<H", ANSWERS["fail"]))
            return
        self.grasped = False
        homing = (self.homed_width, 0.1)
        values = struct.unpack("<5d" if command == 2 else "<2d", payload) if command != 1 else homing
        self.goal, self.speed = values[0], values[-2] if command == 2 else values[1]
        self.pending = (command, number, values[0])

    def fault(self, words: list[str]) -> None:
        match words[0]:
            case "part":
                self.part = float(words[1])
            case "answer":
                self.answer = words[1]
            case "no_hand":
                self.channel.refuse()
            case "unhomed":
                self.max_width = 0.0
            case "fingers":
                self.homed_width = float(words[1])


def main() -> None:
    host, model = sys.argv[1], Path(sys.argv[2]).read_bytes()
    version = int(sys.argv[3]) if len(sys.argv) > 3 else VERSION
    robot = Robot(model=model, version=version, channel=Channel(host, 1337, "<III"))
    hand = Hand(channel=Channel(host, 1338, "<HII"))
    orders = selectors.DefaultSelector()
    orders.register(sys.stdin, selectors.EVENT_READ)
    ask_for_priority()
    print("ready", flush=True)
    due = time.monotonic()
    while True:
        robot.step()
        hand.step()
        if robot.mode == MOVING and robot.answered:
            # A robot waits for nobody; here a busy machine must not make the control loop unstable. It waits
            # half the time after which libfranka takes the link for lost.
            robot.channel.wait_for_datagram(0.5)
        if robot.tick % 10 == 0 and orders.select(0):
            line = sys.stdin.readline()
            if not line:
                return
            words = line.split()
            robot.fault(words)
            hand.fault(words)
            answers = {
                "q": " ".join(map(str, robot.q)),
                "clock": f"{robot.tick * TICK}",
                "load": " ".join(map(str, robot.load)),
                "thresholds": " ".join(map(str, robot.thresholds)),
            }
            print(answers.get(words[0], "done"), flush=True)
        due = max(due + TICK, time.monotonic() - 0.005)
        # Late or not, its client must get a turn: a server that never sleeps starves it on a busy machine.
        time.sleep(max(due - time.monotonic(), TURN_S))


if __name__ == "__main__":
    main()
