"""Friction of part and table against Coulomb's law: bodies that are pushed, slide, spin and rest."""

from __future__ import annotations

import numpy as np
import pytest
import sapien
from sapien import physx
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from mskgrasp.core.settings import Physics
from tasks.scene.table_friction import ROUNDS, STILL, TableFriction, _friction
from tests.benchmarks import pushing, spinning
from tests.benchmarks.quasi_static import corners

PHYSICS = Physics()
GRAVITY = 9.81
FOUR = corners(*pushing.SIZE[:2])


class OnTable:
    """A body of the bar's size and mass on a table, nothing else."""

    def __init__(self, mu: float, rate_hz: int = PHYSICS.rate_hz):
        physx.set_scene_config(enable_tgs=True, enable_pcm=False, cpu_workers=0)
        physx.set_body_config(
            solver_position_iterations=PHYSICS.position_iterations,
            solver_velocity_iterations=1,
            sleep_threshold=0.0,
        )
        physx.set_shape_config(contact_offset=PHYSICS.contact_offset, rest_offset=0.0)
        system = physx.PhysxCpuSystem()
        self.scene = sapien.Scene([system])
        self.scene.set_timestep(1 / rate_hz)
        slippery = physx.PhysxMaterial(0.0, 0.0, 0.0)
        builder = self.scene.create_actor_builder()
        builder.add_box_collision(sapien.Pose([0, 0, -0.02]), np.array([0.5, 0.5, 0.02]), material=slippery)
        table = builder.build_static().find_component_by_type(physx.PhysxRigidStaticComponent)
        builder = self.scene.create_actor_builder()
        builder.add_box_collision(half_size=np.array(pushing.SIZE) / 2, material=slippery)
        builder.set_mass_and_inertia(pushing.MASS, sapien.Pose(), pushing.inertia().astype(np.float32))
        self.entity = builder.build()
        self.entity.set_pose(sapien.Pose([0, 0, pushing.SIZE[2] / 2]))
        self.body = self.entity.find_component_by_type(physx.PhysxRigidDynamicComponent)
        self.friction = TableFriction(system, self.body, table, mu)

    def run(self, n_steps: int, force: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Position (3,) after some steps under a force on the centre of mass."""
        for _ in range(n_steps):
            self.body.add_force_at_point(force, self.entity.pose.p)
            self.friction.apply()
            self.scene.step()
        return np.asarray(self.entity.pose.p, dtype=np.float64)


@pytest.mark.parametrize("over", [False, True], ids=["as it is", "upside down"])
@pytest.mark.parametrize("speed", [0.05, 0.01])
def test_a_pushed_bar_moves_as_quasi_static_mechanics_says(speed: float, over: bool):
    moved = pushing.in_sapien(PHYSICS, speed, over)
    expected = pushing.on_paper(PHYSICS, FOUR)
    assert moved[:2] == pytest.approx(expected[:2], abs=3e-4)
    assert moved[2] == pytest.approx(expected[2], abs=np.radians(0.8))


@pytest.mark.parametrize(("velocity", "spin"), spinning.STARTS)
def test_a_bar_comes_to_rest_where_coulomb_says(velocity: tuple[float, float], spin: float):
    for over in (False, True):
        moved = spinning.in_sapien(PHYSICS, velocity, spin, over=over, own_friction=True)
        expected = spinning.on_paper(PHYSICS, velocity, spin, FOUR, solver=False)
        assert moved[:2] == pytest.approx(expected[:2], abs=3.5e-4)
        assert moved[2] == pytest.approx(expected[2], abs=np.radians(0.5))


@pytest.mark.parametrize("rate_hz", [250, 1000])
def test_a_body_pushed_almost_hard_enough_hardly_creeps(rate_hz: int):
    mu = 0.4
    bar = OnTable(mu, rate_hz)
    rest = bar.run(rate_hz // 20)
    limit = mu * pushing.MASS * GRAVITY
    for share in np.linspace(0, 0.95, rate_hz // 20):
        bar.run(1, force=(share * limit, 0.0, 0.0))
    moved = bar.run(rate_hz // 2, force=(0.95 * limit, 0.0, 0.0)) - rest
    assert np.linalg.norm(moved[:2]) < 0.5 * 1.5e-3 * 250 / rate_hz  # 1.5 mm/s at 250 Hz
    slid = bar.run(rate_hz // 2, force=(1.5 * limit, 0.0, 0.0)) - rest
    assert slid[0] == pytest.approx(0.5 * mu * GRAVITY * 0.5**2 / 2, rel=0.03)


def test_without_friction_a_body_keeps_its_speed():
    bar = OnTable(0.0)
    bar.run(20)
    bar.body.set_linear_velocity([0.2, 0.0, 0.0])
    start = bar.run(1)
    assert bar.run(200)[0] - start[0] == pytest.approx(0.04, rel=1e-2)


def test_a_change_of_the_rate_in_the_middle_changes_nothing():
    ways = []
    for rates in ((1000, 1000), (1000, 500)):
        bar = OnTable(0.4)
        bar.run(20)
        bar.body.set_linear_velocity([0.3, 0.0, 0.0])
        for rate_hz in rates:
            bar.scene.set_timestep(1 / rate_hz)
            bar.run(rate_hz // 20)
        ways.append(bar.run(1)[0])
    assert ways[1] == pytest.approx(ways[0], rel=0.02)


def test_a_body_in_the_air_gets_no_friction():
    bar = OnTable(0.4)
    bar.entity.set_pose(sapien.Pose([0, 0, 0.3]))
    bar.body.set_linear_velocity([0.3, 0.0, 0.0])
    bar.friction.reset()
    bar.run(100)
    assert bar.body.linear_velocity[0] == pytest.approx(0.3, rel=1e-3)


def test_friction_is_the_least_squares_of_its_energy():
    rng = np.random.default_rng(0)
    axes = Rotation.random(rng=rng).as_matrix()
    mass, moments, centre = 0.3, np.array([1e-4, 3e-4, 2e-4]), rng.normal(size=3)
    points, most = centre + 0.03 * rng.normal(size=(5, 3)), rng.uniform(1e-6, 3e-4, 5)
    now, free = 0.1 * rng.normal(size=(2, 6))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, centre
    change, impulse = _friction(pose, mass, moments, now, free, points, most)
    # The slip of a point at each unit velocity is a column of its Jacobian.
    slips = [np.tile(unit[:3], (5, 1)) + np.cross(unit[3:], points - centre) for unit in np.eye(6)]
    jacobian = np.stack(slips, axis=-1)[:, :2]
    inertia = block_diag(mass * np.eye(3), axes @ np.diag(moments) @ axes.T)
    velocity = now
    for _ in range(ROUNDS):
        drag = most / np.sqrt(np.sum((jacobian @ velocity) ** 2, axis=1) + STILL**2)
        resistance = np.einsum("k,kia,kib->ab", drag, jacobian, jacobian)
        velocity = np.linalg.solve(inertia + resistance, inertia @ free)
    assert change == pytest.approx(velocity - free, abs=1e-12)
    assert impulse == pytest.approx(inertia @ (velocity - free), abs=1e-12)
