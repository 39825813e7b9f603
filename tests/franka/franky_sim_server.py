"""franky-sim in a process of its own: ``python -m tests.franka.franky_sim_server HOST PART_WIDTH``.

An FR3 over the real wire protocol of server version 10, its dynamics in MuJoCo. A part width in metres
keeps the fingers that far apart, as a part between them would; 0 for none.
"""

from __future__ import annotations

import sys
import time

import franky_sim
import mujoco
from franky_sim.mujoco_simulator import MujocoSimulator

_LATE_S = 0.005


def main() -> None:
    host, part_width = sys.argv[1], float(sys.argv[2])
    with MujocoSimulator() as simulator:
        simulator.add_robot()
        with franky_sim.SimulationServer(simulator, hostname_candidates=[host]) as server:
            model = simulator.model
            assert model is not None
            for name in ("robot0_finger_joint1", "robot0_finger_joint2"):
                joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
                model.jnt_range[joint, 0] = part_width / 2
            print("ready", flush=True)
            serve(server)


def serve(server: franky_sim.SimulationServer) -> None:
    """As `run_forever`, which sleeps at every tick, be it for 0 s: a busy machine then takes 3 ms for 1."""
    due = time.monotonic()
    while True:
        for robot in server.robot_servers:
            robot.process_commands()
        server.sim.step()
        for robot in server.robot_servers:
            robot.send_state()
        due = max(due + 1e-3, time.monotonic() - _LATE_S)
        ahead = due - time.monotonic()
        if ahead > 1e-4:
            time.sleep(ahead)


if __name__ == "__main__":
    main()
