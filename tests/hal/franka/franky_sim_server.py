"""franky-sim in a process of its own: ``python -m tests.hal.franka.franky_sim_server HOST``.

An FR3 over the real wire protocol of server version 10, its dynamics in MuJoCo. Faults, which franky-sim does
not have, are commanded on standard input, one a line, as in `tests.hal.franka.fci5_server`:

    reflex | user_stop | user_release | part WIDTH | answer ok|unsuccessful|fail|aborted | q | clock |
    no_hand (its server refuses clients) | refuse_stops N (the next commands to stop) |
    table Z SLOPE (a table that pushes the hand up) | load (answers with what was set) |
    record (the commands of motions from now on) | save FILE (them, as `commands` reads it)
"""

from __future__ import annotations

import select
import sys
import time
from typing import Any

import franky_sim
import mujoco
import numpy as np
from franky_sim.franka_gripper_protocol import GripperCommand, GripperCommandStatus
from franky_sim.franka_robot_protocol import (
    AutomaticErrorRecoveryCommand,
    MoveStatus,
    RobotCommand,
    RobotMode,
    SetCollisionBehaviorCommand,
    SetLoadCommand,
    StopMoveCommand,
    UDPCommand,
)
from franky_sim.franka_robot_server import FrankaRobotServer
from franky_sim.franka_robot_state import FrankaRobotState
from franky_sim.franka_server import BaseCommand
from franky_sim.mujoco_simulator import MujocoSimulator

from tests.hal.franka.quick_franky_sim import QuickSimulator, pack_state, replace
from tests.hal.franka.wire import Table, ask_for_priority

_LATE_S = 0.005
_TURN_S = 3e-4
_AT_REST_TICKS, _RESTING = 200, 4
"""A robot that was told nothing for so many ticks simulates one of so many, and sends its state as often."""
_CARTESIAN_REFLEX = 7
_NOT_POSSIBLE = 1
"""Answer to a command that is not possible in the robot's mode."""
ANSWERS = {
    "ok": GripperCommandStatus.kSuccess,
    "unsuccessful": GripperCommandStatus.kUnsuccessful,
    "fail": GripperCommandStatus.kFail,
    "aborted": GripperCommandStatus.kAborted,
}


class FaultyServer(FrankaRobotServer):
    """franky-sim's server with a reflex, a user stop and a record of what is commanded."""

    fault: RobotMode | None = None
    table: Table | None = None
    ticks = 0
    busy_until = 0
    record: list[UDPCommand] | None = None
    answered = False
    refused_stops = 0

    @property
    def robot_state(self) -> FrankaRobotState:
        state = super().robot_state
        if not (self.current_motion_id and self.answered):
            # A robot at rest desires none; franky-sim differentiates measurements, in which a joint chatters.
            state = state.replace(
                dq_d=(0.0,) * 7, ddq_d=(0.0,) * 7, O_dP_EE_c=(0.0,) * 6, O_ddP_EE_c=(0.0,) * 6
            )
        if self.table is not None:
            push = self.table.push(state.O_T_EE[12], state.O_T_EE[14])
            state = state.replace(O_F_ext_hat_K=(0.0, 0.0, push, 0.0, 0.0, 0.0))
        if self.fault is None:
            return state
        reasons = tuple(self.fault is RobotMode.kReflex and k == _CARTESIAN_REFLEX for k in range(41))
        return state.replace(robot_mode=self.fault, reflex_reason=reasons)

    def _handle_udp_command(self, command_data: bytes) -> None:
        super()._handle_udp_command(command_data)
        command = UDPCommand.from_bytes(command_data)
        self.answered = not command.motion_generation_finished
        if self.record is not None:
            self.record.append(command)

    def start_motion(self, controller_mode, motion_generator_mode, motion_id) -> None:
        """A robot starts from where it was commanded to be; franky-sim would step to where it is measured."""
        self.answered = False
        desired = self.robot.state
        super().start_motion(controller_mode, motion_generator_mode, motion_id)
        self._FrankaRobotServer__current_control_command = UDPCommand(
            q_c=tuple(desired.q_d), O_T_EE_c=tuple(desired.O_T_EE_d)
        )

    def pass_time(self) -> int:
        """Ticks until the next step: one, or several where neither arm nor hand moves."""
        if self.current_motion_id or self.gripper_server._motion_state.name != "IDLE":
            self.busy_until = self.ticks + _AT_REST_TICKS
        passed = 1 if self.ticks < self.busy_until else _RESTING
        self.ticks += passed
        return passed

    def wait_for_command(self) -> None:
        """A record has no gaps: a busy client's command comes late, and a robot waits for nobody."""
        if self.record is not None and self.current_motion_id and self.answered:
            select.select([getattr(self, "_FrankaServer__udp_socket")], [], [], 0.5)  # noqa: B009

    def set_fault(self, mode: RobotMode, status: MoveStatus) -> None:
        self.fault = mode
        number = self.current_motion_id
        self.stop_motion(send_preemption_signal=False)
        self.reset_current_motion_id()
        if number:
            BaseCommand.send_response(self._tcp_socket, RobotCommand.kMove, number, status)


class Recovery(AutomaticErrorRecoveryCommand):
    def handle(self, server: FaultyServer) -> None:
        if server.fault is RobotMode.kReflex:
            server.fault = None
        super().handle(server)


class Stop(StopMoveCommand):
    def handle(self, server: FaultyServer) -> None:
        if server.refused_stops:
            server.refused_stops -= 1
            self.reply(_NOT_POSSIBLE)
        else:
            super().handle(server)


class Thresholds(SetCollisionBehaviorCommand):
    def handle(self, server: FaultyServer) -> None:
        if server.fault is None:
            super().handle(server)
        else:
            self.reply(_NOT_POSSIBLE)


class Payload(SetLoadCommand):
    def handle(self, server: FaultyServer) -> None:
        if server.fault is None:
            super().handle(server)
        else:
            self.reply(_NOT_POSSIBLE)


class Answers:
    """Stands in the way of the gripper's answers to grasps; after a failure it reports no grasp."""

    def __init__(self) -> None:
        self.status = GripperCommandStatus.kSuccess
        self.hand: Any = None
        self._send = BaseCommand.send_response
        BaseCommand.send_response = self.send  # type: ignore[method-assign]

    def send(self, sock, command, number, status, payload=b"", **formats) -> None:
        if command is GripperCommand.kGrasp and status is GripperCommandStatus.kSuccess:
            status = self.status
            self.hand._is_grasping = status is GripperCommandStatus.kSuccess
        self._send(sock, command, number, status, payload, **formats)


def main() -> None:
    FrankaRobotState.replace, FrankaRobotState.pack_state = replace, pack_state  # type: ignore[method-assign]
    answers = Answers()
    with QuickSimulator() as simulator:
        simulator.add_robot()
        with franky_sim.SimulationServer(simulator, hostname_candidates=[sys.argv[1]]) as server:
            robot = server.robot_servers[0]
            robot.__class__ = FaultyServer
            answers.hand = robot.gripper_server
            commands = robot._FrankaServer__command_class_map
            for command in (Recovery, Stop, Thresholds, Payload):
                assert commands[command.command_type] is command.__base__
                commands[command.command_type] = command
            ask_for_priority()
            print("ready", flush=True)
            serve(server, simulator, robot, answers)


def serve(server, simulator: MujocoSimulator, robot: FaultyServer, answers: Answers) -> None:
    """As `run_forever`, which sleeps at every tick, be it for 0 s: a busy machine then takes 3 ms for 1."""
    due = time.monotonic()
    while True:
        robot.process_commands()
        simulator.step()
        robot.send_state()
        passed = robot.pass_time()
        robot.wait_for_command()
        if select.select([sys.stdin], [], [], 0)[0]:
            line = sys.stdin.readline()
            if not line:
                return
            print(obey(line.split(), simulator, robot, answers), flush=True)
            if line.strip() != "clock":
                robot.busy_until = robot.ticks + _AT_REST_TICKS
        due = max(due + passed * 1e-3, time.monotonic() - _LATE_S)
        # Late or not, its client must get a turn: a server that never sleeps starves it on a busy machine.
        time.sleep(max(due - time.monotonic(), _TURN_S))


def obey(words: list[str], simulator: MujocoSimulator, robot: FaultyServer, answers: Answers) -> str:
    match words:
        case ["reflex"]:
            robot.set_fault(RobotMode.kReflex, MoveStatus.kReflexAborted)
        case ["user_stop"]:
            robot.set_fault(RobotMode.kUserStopped, MoveStatus.kPreempted)
        case ["user_release"]:
            robot.fault = None
        case ["refuse_stops", count]:
            robot.refused_stops = int(count)
        case ["no_hand"]:
            robot.gripper_server.cleanup()
            robot.gripper_server.process_commands = lambda: None
        case ["answer", status]:
            answers.status = ANSWERS[status]
        case ["table", z, slope_x]:
            robot.table = Table(z=float(z), slope_x=float(slope_x))
        case ["part", width]:
            model = simulator.model
            assert model is not None
            for name in ("robot0_finger_joint1", "robot0_finger_joint2"):
                joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
                model.jnt_range[joint, 0] = float(width) / 2
        case ["load"]:
            inner = robot.robot
            return " ".join(map(str, [inner.m_load, *inner.F_x_Cload, *inner.I_load]))
        case ["q"]:
            return " ".join(str(value) for value in robot.robot.inner_state.q)
        case ["clock"]:
            return str(robot.ticks * 1e-3)
        case ["record"]:
            robot.record = []
        case ["save", file]:
            assert robot.record
            np.savez(
                file,
                ticks=[command.message_id for command in robot.record],
                joints=[command.q_c for command in robot.record],
                poses=[np.reshape(command.O_T_EE_c, (4, 4), order="F") for command in robot.record],
                elbows=[command.elbow_c for command in robot.record],
            )
            robot.record = None
        case _:
            raise ValueError(words)
    return "done"


if __name__ == "__main__":
    main()
