from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hal.config import READY
from hal.mujoco.config import MujocoPhysics
from hal.mujoco.simulation import Simulation
from mskgrasp.core.geometry import Pose
from mskgrasp.core.minimum_jerk import minimum_jerk_steps
from mskgrasp.core.panda_kinematics import top_down
from mskgrasp.parts import Part
from tests.boxes import make_box

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

MakeBox = Callable[[tuple[float, float, float], float], Part]


@pytest.fixture(scope="session")
def box(tmp_path_factory: pytest.TempPathFactory) -> MakeBox:
    """Makes a box of a size, metres, and a mass, kg."""
    cache = tmp_path_factory.mktemp("boxes")

    def make(size: tuple[float, float, float], mass: float) -> Part:
        name = "box_" + "x".join(f"{1e4 * edge:.0f}" for edge in (*size, mass))
        return make_box(cache, name, size, mass)

    return make


def on_table(
    part: Part, physics: MujocoPhysics | None = None, *, x: float = 0.5, y: float = 0.0
) -> Simulation:
    """A box upright on the table, the arm at home."""
    pose = Pose(position=np.array([x, y, part.extents[2] / 2]), quat_wxyz=UPRIGHT)
    return Simulation(physics or MujocoPhysics(), [part], [pose], np.array(READY))


def held(
    part: Part,
    physics: MujocoPhysics | None = None,
    *,
    force: float = 20.0,
    y: float = 0.0,
    height: float = 0.02,
) -> Simulation:
    """A box that was ``y`` metres off the middle, gripped at a height and lifted by 10 cm."""
    simulation = on_table(part, physics, y=y)

    def joints(z: float) -> np.ndarray:
        return top_down(np.array([0.5, 0.0, z, 0.0]))[0]

    simulation.data.qpos[:7] = simulation.target = joints(height)
    simulation.move_fingers(-0.08, force=force, stop=never)
    shares = np.concatenate([[0.0], minimum_jerk_steps(simulation.n_steps(0.75))])
    assert simulation.follow(np.array([joints(height + 0.1 * share) for share in shares]), stop=never)
    simulation.stand(0.2, stop=never)
    return simulation


def never() -> bool:
    return False
