"""A flat part pushed in the engines: a wall's edge turns a bar on the table, against quasi-static mechanics.

The bar (80 x 20 x 12 mm) lies turned by 23.7 degrees; the left edge of a pad 17.5 mm wide meets it 7 mm from
its centre and pushes it by 9.1 mm. In both engines it rests on its four corners. Inertia hardly counts:
v^2 / (2 mu g) is 1.3 mm at 0.1 m/s and 0.01 mm at 0.01 m/s.

Each row also gives the bar turned upside down: the same body, whose corners an engine lists in another order.
The task replaces PhysX's friction of part and table by its own (`tasks.scene.table_friction`).

In a second table two pads close on a bar whose centre is in their middle. The pads' edges slip along the bar
in opposite ways and turn it. Half a turn maps bar and pads onto themselves, so that its centre may not move.

Run: python -m tests.benchmarks.pushing
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sapien
import trimesh
from sapien import physx

from hal.mujoco.config import MujocoPhysics
from mskgrasp.core.settings import Physics
from mskgrasp.runtime.console_table import Table
from tasks.scene.table_friction import TableFriction
from tests.benchmarks.quasi_static import Push, corners, rectangle
from tests.benchmarks.report import show

SIZE = (0.08, 0.02, 0.012)
MASS = 0.15072
START = (-0.01934, 0.01945, np.radians(-23.68))
"""x, y, angle of the bar; the pad closes towards y = 0."""
PAD = (0.0175, 0.0152, 0.0185)
WAY = 0.0091
SPEEDS = (0.1, 0.05, 0.02, 0.01)
_CLEAR = 0.0003
"""Distance of pad and bar, and of pad and table, at the start, m."""
BETWEEN = (0.0, 0.0, START[2])
"""x, y, angle of a bar between two pads."""


def inertia() -> np.ndarray:
    """Principal moments (3,) of the bar, kg m^2."""
    square = np.array(SIZE) ** 2
    return MASS / 12 * (square.sum() - square)


def first_contact(start: tuple[float, float, float] = START) -> float:
    """y of the pad's face when its edge meets the bar, m."""
    x, y, angle = start
    return y + (SIZE[1] / 2 + (-PAD[0] / 2 - x) * np.sin(angle)) / np.cos(angle)


def pad_centre(face: float, side: int = 1) -> np.ndarray:
    """Centre (3,) of the pad with its face at some y, or of the one on the other side (-1)."""
    return np.array([0.0, side * (face + PAD[1] / 2), PAD[2] / 2 + _CLEAR])


def steps(speed: float, rate_hz: float, *, between: bool) -> Iterator[float]:
    """y of the pad's face after each step."""
    first = first_contact(BETWEEN if between else START)
    way = first - SIZE[1] / 2 - _CLEAR if between else WAY
    n = round((way + _CLEAR) / speed * rate_hz)
    return (first + _CLEAR - speed * (k + 1) / rate_hz for k in range(n))


def on_paper(physics: Physics, points: np.ndarray) -> np.ndarray:
    """Motion (3,) of the bar: x and y in metres, angle in radians."""
    push = Push(
        support=points,
        weight=np.full(len(points), 1 / len(points)),
        mu=physics.friction_pad_part,
        half_thickness=SIZE[1] / 2,
    )
    return push.run(np.array(START), -PAD[0] / 2, WAY) - START


def in_physx(physics: Physics, speed: float, over: bool, *, between: bool = False) -> np.ndarray:
    """The same in plain SAPIEN with PhysX's friction; pads are kinematic."""
    return in_sapien(physics, speed, over, between=between, own_friction=False)


def in_sapien(
    physics: Physics, speed: float, over: bool, *, between: bool = False, own_friction: bool = True
) -> np.ndarray:
    """The same in plain SAPIEN with the settings of the task; pads are kinematic."""
    start = BETWEEN if between else START
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
    slippery = physx.PhysxMaterial(0.0, 0.0, 0.0)
    rubber = physx.PhysxMaterial(2 * physics.friction_pad_part, 2 * physics.friction_pad_part, 0.0)
    rough = physx.PhysxMaterial(2 * physics.friction_table_part, 2 * physics.friction_table_part, 0.0)
    builder = scene.create_actor_builder()
    builder.add_box_collision(
        sapien.Pose([0, 0, -0.02]), np.array([0.5, 0.5, 0.02]), material=slippery if own_friction else rough
    )
    table = builder.build_static().find_component_by_type(physx.PhysxRigidStaticComponent)
    assert isinstance(table, physx.PhysxRigidStaticComponent)
    builder = scene.create_actor_builder()
    builder.add_box_collision(half_size=np.array(SIZE) / 2, material=slippery)
    builder.set_mass_and_inertia(MASS, sapien.Pose(), inertia().astype(np.float32))
    bar = builder.build()
    bar.set_pose(sapien.Pose([*start[:2], SIZE[2] / 2], _turned(start[2], over)))
    bodies = {}
    for side in (1, -1) if between else (1,):
        builder = scene.create_actor_builder()
        builder.add_box_collision(half_size=np.array(PAD) / 2, material=rubber)
        pad = builder.build_kinematic()
        pad.set_pose(sapien.Pose(pad_centre(first_contact(start) + _CLEAR, side)))
        bodies[side] = pad.find_component_by_type(physx.PhysxRigidDynamicComponent)
    pushed = bar.find_component_by_type(physx.PhysxRigidDynamicComponent)
    assert isinstance(pushed, physx.PhysxRigidDynamicComponent)
    friction = TableFriction(system, pushed, table, physics.friction_table_part)
    for face in steps(speed, physics.rate_hz, between=between):
        for side, body in bodies.items():
            assert isinstance(body, physx.PhysxRigidDynamicComponent)
            body.set_kinematic_target(sapien.Pose(pad_centre(face, side)))
        if own_friction:
            friction.apply()
        scene.step()
    return _moved(np.asarray(bar.pose.to_transformation_matrix(), dtype=np.float64), start)


def in_mujoco(physics: Physics, speed: float, over: bool, *, between: bool = False) -> np.ndarray:
    """The same in plain MuJoCo with the settings of its cell; pads are heavy and keep their speed."""
    import mujoco

    from hal.mujoco.scene import FRICTION_STIFFNESS

    own, start = MujocoPhysics(), BETWEEN if between else START
    spec = mujoco.MjSpec()
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    option = spec.option
    option.timestep, option.noslip_iterations = own.step_s, own.noslip_iterations
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, FRICTION_STIFFNESS
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.iterations, option.tolerance = own.solver_iterations, 1e-9
    stiff = dict(solref=[own.contact_time_s, 1], solimp=[*own.contact_impedance, 0.5, 2], condim=3)
    table, part = [physics.friction_table_part, 0, 0], [physics.friction_pad_part, 0, 0]
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], friction=table, priority=1, **stiff
    )
    bar = spec.worldbody.add_body(name="bar", pos=[*start[:2], SIZE[2] / 2], quat=_turned(start[2], over))
    bar.add_freejoint()
    bar.explicitinertial, bar.mass, bar.inertia = True, MASS, inertia()
    bar.ipos, bar.iquat = [0, 0, 0], [1, 0, 0, 0]  # by default those of the body
    points = trimesh.creation.box(np.array(SIZE)).vertices
    spec.add_mesh(name="bar", uservert=np.asarray(points).ravel())
    bar.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="bar", friction=table, **stiff)
    sides = (1, -1) if between else (1,)
    for side in sides:
        pad = spec.worldbody.add_body(pos=pad_centre(first_contact(start) + _CLEAR, side))
        pad.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=np.array(PAD) / 2, friction=part, priority=2, **stiff
        )
        pad.explicitinertial, pad.mass, pad.inertia, pad.ipos = True, 10.0, [10.0] * 3, [0, 0, 0]
        pad.add_joint(name=f"slide{side}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, side, 0])
        pad.gravcomp = 1
    model = spec.compile()
    data = mujoco.MjData(model)
    slides = [model.joint(f"slide{side}") for side in sides]
    for face in steps(speed, 1 / own.step_s, between=between):
        for slide in slides:
            data.qvel[slide.dofadr[0]] = -speed
            data.qpos[slide.qposadr[0]] = face - first_contact(start) - _CLEAR + speed * own.step_s
        mujoco.mj_step(model, data)
    pose = np.eye(4)
    mujoco.mj_kinematics(model, data)
    pose[:3, :3], pose[:3, 3] = data.body("bar").xmat.reshape(3, 3), data.body("bar").xpos
    return _moved(pose, start)


def slid(moved: np.ndarray) -> float:
    """Slide along itself, m, of a bar that was between two pads."""
    x, y, angle = BETWEEN + moved
    return float(x * np.cos(angle) + y * np.sin(angle))


def _turned(angle: float, over: bool) -> list[float]:
    """Quaternion (w, x, y, z) of a turn about z, and before it of half a turn about x."""
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    return [0.0, c, s, 0.0] if over else [c, 0.0, 0.0, s]


def _moved(pose: np.ndarray, start: tuple[float, float, float]) -> np.ndarray:
    """How far (x, y, angle) a bar at a pose (4, 4) has come."""
    return np.array([*pose[:2, 3], np.arctan2(pose[1, 0], pose[0, 0])]) - start


def main() -> None:
    """Prints the motion by quasi-static mechanics and in both engines."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rate-hz", type=int, default=Physics().rate_hz)
    parser.add_argument("--iterations", type=int, default=Physics().position_iterations)
    parser.add_argument("--pcm", action="store_true", help="keep PhysX' contact points from step to step")
    parser.add_argument("--out", type=Path, help="folder for report.json")
    given = parser.parse_args()
    physics = Physics(
        rate_hz=given.rate_hz, position_iterations=given.iterations, persistent_manifold=given.pcm
    )
    four = corners(*SIZE[:2])
    rows: list[tuple[str, ...]] = []
    squeezed: list[tuple[str, ...]] = [("on paper", "0.00", "0.00")]
    for name, points in (
        ("even pressure", rectangle(*SIZE[:2])),
        ("four corners", four),
        ("one diagonal", four[[0, 2]]),
        ("the other diagonal", four[[1, 3]]),
    ):
        rows.append((f"quasi-static, {name}", *_row(on_paper(physics, points)), "", "", ""))
    for name, run in (
        ("SAPIEN, PhysX's friction", in_physx),
        ("SAPIEN, friction of the task", in_sapien),
        ("MuJoCo", in_mujoco),
    ):
        for speed in SPEEDS:
            moved = [_row(run(physics, speed, over)) for over in (False, True)]
            rows.append((f"{name}, {speed:g} m/s", *moved[0], *moved[1]))
            slides = [f"{1e3 * slid(run(physics, speed, over, between=True)):.2f}" for over in (False, True)]
            squeezed.append((f"{name}, {speed:g} m/s", *slides))
    header = ("motion of the bar", "x, mm", "y, mm", "turn, deg", "upside down: x, mm", "y, mm", "turn, deg")
    between = ("bar between two pads", "slide along itself, mm", "upside down, mm")
    show([Table(header=header, rows=rows), Table(header=between, rows=squeezed)], given.out)


def _row(moved: np.ndarray) -> list[str]:
    return [f"{value:.2f}" for value in moved * [1e3, 1e3, 180 / np.pi]]


if __name__ == "__main__":
    main()
