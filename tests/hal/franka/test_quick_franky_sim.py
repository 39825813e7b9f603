"""franky-sim made quicker is franky-sim: its messages and its robot are the same."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest
from franky_sim.franka_robot_protocol import RobotMode
from franky_sim.mujoco_simulator import MujocoSimulator

from tests.hal.franka.quick_franky_sim import QuickSimulator, pack_state, replace


@contextmanager
def started(*kinds: type[MujocoSimulator]) -> Iterator[list[MujocoSimulator]]:
    with ExitStack() as stack:
        simulators = [stack.enter_context(kind()) for kind in kinds]
        for simulator in simulators:
            simulator.add_robot()
            simulator.start()
        yield simulators


def test_a_state_is_packed_as_franky_sim_packs_it():
    with started(QuickSimulator) as [simulator]:
        robot = simulator.robots[0]
        robot.set_load(0.4, (0.01, 0.02, 0.03), (1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3))
        for tick in range(20):
            robot.joint_position_control(np.array(robot.initial_q) + 0.02 * (1 - np.cos(tick / 40)))
            simulator.step()
        state = robot.state
    assert pack_state(state) == state.pack_state()
    for fault in (RobotMode.kUserStopped, RobotMode.kReflex):
        changed = {"robot_mode": fault, "dq_d": (0.5,) * 7, "reflex_reason": (True,) + (False,) * 40}
        assert replace(state, **changed) == state.replace(**changed)
        assert pack_state(replace(state, **changed)) == state.replace(**changed).pack_state()


def test_without_the_meshes_that_are_looked_at_bodies_joints_and_contacts_are_the_same():
    with started(QuickSimulator, MujocoSimulator) as simulators:
        quick, slow = (simulator.model for simulator in simulators)
        assert quick is not None and slow is not None and quick.nmesh < slow.nmesh
        moving, meeting = slow.body_dofnum > 0, slow.geom_contype != 0
        for name in ("mass", "inertia", "ipos", "iquat", "pos", "quat", "parentid"):
            values = getattr(slow, f"body_{name}")[moving]
            assert np.array_equal(getattr(quick, f"body_{name}")[moving], values), name
        for name in ("damping", "armature", "frictionloss"):
            assert np.array_equal(getattr(quick, f"dof_{name}"), getattr(slow, f"dof_{name}")), name
        for name in ("bodyid", "type", "size", "pos", "quat", "friction", "contype", "conaffinity", "solref"):
            values = getattr(slow, f"geom_{name}")[meeting]
            assert np.array_equal(getattr(quick, f"geom_{name}"), values), name
        for tick in range(50):
            for simulator in simulators:
                robot = simulator.robots[0]
                robot.joint_position_control(np.array(robot.initial_q) + 0.02 * (1 - np.cos(tick / 40)))
                simulator.step()
        places = [simulator.robots[0].state.q for simulator in simulators]
        # The last joint chatters later on, which magnifies the last bits of rounding.
        assert places[0] == pytest.approx(places[1], abs=1e-12)
