"""A bar that slides and turns to rest on the table: PhysX and the task against Coulomb's law.

PhysX replaces the contacts of two bodies that share a normal by two anchors, the points farthest apart, and
gives each half of the friction. Of an anchor's two tangential impulses, each grows in proportion to the slip
along its axis times the effective mass there, and both together are cut to mu times the load
(DyTGSContactPrep.cpp, solveContact). A sliding anchor's friction therefore points along effective mass times
slip, not along the slip: away from the centre of mass these differ, by up to 30 degrees for this bar. The
task has its own friction on the table (`tasks.scene.table_friction`).

Run: python -m tests.benchmarks.spinning
"""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx
from scipy.integrate import solve_ivp

from mskgrasp.core.settings import Physics
from tasks.scene.table_friction import TableFriction
from tests.benchmarks.pushing import MASS, SIZE, inertia
from tests.benchmarks.quasi_static import corners

GRAVITY = 9.81
STARTS = (((0.0, 0.0), 10.0), ((0.0, 0.3), 3.0), ((0.3, 0.0), 3.0), ((0.2, 0.2), 10.0))
"""Velocities, m/s and rad/s."""
TIME_S = 0.25
"""In which every bar comes to rest."""
_REST = 1e-5
"""Points slower than this, m/s, count as in transition to rest."""
_ALONG = 0.01
"""Speed of the body, m/s, above which PhysX aligns its first tangential axis with it."""


def on_paper(
    physics: Physics, velocity: tuple[float, float], spin: float, points: np.ndarray, *, solver: bool
) -> np.ndarray:
    """Way (x, y) in metres and turn in radians of a bar on equally loaded points.

    Args:
        physics: Friction of the table.
        velocity: At the start, m/s.
        spin: At the start, rad/s.
        points: (n, 2) in the bar's frame.
        solver: With the direction of friction of PhysX's solver, else against the slip.
    """
    square = (SIZE[0] ** 2 + SIZE[1] ** 2) / 12

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        c, s = np.cos(state[2]), np.sin(state[2])
        arm = points @ np.array([[c, s], [-s, c]])
        slip = state[3:5] + state[5] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        if solver:
            speed = np.hypot(*state[3:5])
            first = state[3:5] / speed if speed > _ALONG else np.array([0.0, -1.0])
            axes = np.stack([first, [-first[1], first[0]]])
            lever = arm[:, :1] * axes[:, 1] - arm[:, 1:] * axes[:, 0]
            slip = (slip @ axes.T / (1 + lever**2 / square)) @ axes
        size = np.sqrt((slip**2).sum(axis=1) + _REST**2)
        force = -physics.friction_table_part * GRAVITY / len(points) * slip / size[:, None]
        moment = (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum()
        return np.r_[state[3:], force.sum(axis=0), moment / square]

    start = np.array([0.0, 0.0, 0.0, *velocity, spin])
    found = solve_ivp(rates, (0, TIME_S), start, method="BDF", rtol=1e-7, atol=1e-9, max_step=2e-3)
    return found.y[:3, -1]


def in_sapien(
    physics: Physics, velocity: tuple[float, float], spin: float, *, over: bool, own_friction: bool
) -> np.ndarray:
    """The same in plain SAPIEN, with the task's friction or PhysX's.

    Upside down on request, so that PhysX's anchors lie on the other diagonal.
    """
    physx.set_scene_config(enable_tgs=True, enable_pcm=physics.persistent_manifold, cpu_workers=0)
    physx.set_body_config(
        solver_position_iterations=physics.position_iterations,
        solver_velocity_iterations=1,
        sleep_threshold=0.0,
    )
    physx.set_shape_config(contact_offset=physics.contact_offset, rest_offset=0.0)
    system = physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    scene.set_timestep(1 / physics.rate_hz)
    mu = 0.0 if own_friction else physics.friction_table_part
    material = physx.PhysxMaterial(mu, mu, 0.0)
    builder = scene.create_actor_builder()
    builder.add_box_collision(sapien.Pose([0, 0, -0.02]), np.array([0.5, 0.5, 0.02]), material=material)
    table = builder.build_static().find_component_by_type(physx.PhysxRigidStaticComponent)
    assert isinstance(table, physx.PhysxRigidStaticComponent)
    builder = scene.create_actor_builder()
    builder.add_box_collision(half_size=np.array(SIZE) / 2, material=material)
    builder.set_mass_and_inertia(MASS, sapien.Pose(), inertia().astype(np.float32))
    bar = builder.build()
    body = bar.find_component_by_type(physx.PhysxRigidDynamicComponent)
    assert isinstance(body, physx.PhysxRigidDynamicComponent)
    body.set_angular_damping(0.0)
    bar.set_pose(sapien.Pose([0, 0, SIZE[2] / 2], [0, 1, 0, 0] if over else [1, 0, 0, 0]))
    friction = TableFriction(system, body, table, physics.friction_table_part)

    def step() -> None:
        if own_friction:
            friction.apply()
        scene.step()

    for _ in range(20):
        step()
    body.set_linear_velocity(np.array([*velocity, 0.0]))
    body.set_angular_velocity(np.array([0.0, 0.0, spin]))
    friction.reset()
    for _ in range(round(TIME_S * physics.rate_hz)):
        step()
    pose = bar.pose.to_transformation_matrix()
    return np.array([*pose[:2, 3], np.arctan2(pose[1, 0], pose[0, 0])], dtype=np.float64)


def main() -> None:
    """Prints way and turn by the two laws and in SAPIEN, for both diagonals."""
    physics, four = Physics(), corners(*SIZE[:2])
    for velocity, spin in STARTS:
        print(f"{velocity} m/s, {spin:g} rad/s: x mm, y mm, turn deg")
        print(
            f"  {'Coulomb, four corners':34s}{_show(on_paper(physics, velocity, spin, four, solver=False))}"
        )
        for over, diagonal in ((False, four[[1, 3]]), (True, four[[0, 2]])):
            name = "the other diagonal" if over else "one diagonal"
            for law, solver in (("Coulomb", False), ("PhysX' law", True)):
                moved = on_paper(physics, velocity, spin, diagonal, solver=solver)
                print(f"  {f'{law}, {name}':34s}{_show(moved)}")
            for whose, own in (("PhysX", False), ("the task", True)):
                moved = in_sapien(physics, velocity, spin, over=over, own_friction=own)
                print(f"  {f'{whose}, {name}':34s}{_show(moved)}", flush=True)


def _show(moved: np.ndarray) -> str:
    x, y, turn = moved * [1e3, 1e3, 180 / np.pi]
    return f"{x:7.2f} {y:7.2f} {turn:7.2f}"


if __name__ == "__main__":
    main()
