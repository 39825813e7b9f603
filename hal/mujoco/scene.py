"""MuJoCo model of the cell: table, Panda, and the parts on the table."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
import trimesh

from hal.mujoco.config import MujocoPhysics
from hal.mujoco.panda import HAND_BODIES, HIDDEN, OTHERS, SEEN, add_panda, stiff
from mskgrasp.core.geometry import Pose
from mskgrasp.core.settings import TABLE_Z
from mskgrasp.parts import Part
from mskgrasp.parts.hulls import hull_corners

FRICTION_STIFFNESS = 100.0
"""Stiffness of friction by that of contact (``impratio``). With 10 a part that is held by a strip of 2 mm
creeps: 7 degrees a second at four fifths of the limit."""
_FOUND_AND_FORCE = 0b11
_NET_FORCE = 3
MEMORY = 512 << 20
"""Bytes for contacts; what they do not use is never touched. MuJoCo's own guess for one part is 14 MiB: a
lattice on 512 points needs more, and then nothing at all holds it."""
_TABLE_COLOUR, _PART_COLOUR = (0.33, 0.35, 0.38, 1.0), (0.55, 0.57, 0.6, 1.0)


def build_model(
    physics: MujocoPhysics, parts: Sequence[Part], table_motion: Pose | None = None
) -> mujoco.MjModel:
    """Compile the model of the cell; the first part is ``part0``, the one that is grasped.

    Sensors: ``<body>_force`` of every body of the hand and of ``part0`` counts the contacts of that body and
    sums their forces (number, x, y, z; MuJoCo gives the force that the body exerts); ``grip`` is the same for
    all contacts between hand and ``part0``. The table is level and at its stated height unless
    a motion displaces it.
    """
    spec = mujoco.MjSpec()
    spec.memory = MEMORY
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    option = spec.option
    option.timestep = physics.step_s
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = physics.solver_iterations
    option.noslip_iterations = physics.noslip_iterations
    option.tolerance = 1e-9
    option.impratio = FRICTION_STIFFNESS
    option.gravity = [0, 0, -9.81]
    add_panda(spec, physics)
    stated = np.array([0, 0, TABLE_Z])
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=stated if table_motion is None else table_motion.apply(stated),
        quat=[1, 0, 0, 0] if table_motion is None else table_motion.quat_wxyz,
        size=[0, 0, 0.1],
        group=SEEN,
        priority=1,
        rgba=_TABLE_COLOUR,
        **_contact(physics, physics.friction_table_part),
    )
    for i, part in enumerate(parts):
        _add_part(spec, f"part{i}", part, physics)
    contacts = dict(type=mujoco.mjtSensor.mjSENS_CONTACT, intprm=[_FOUND_AND_FORCE, _NET_FORCE, 1])
    for body in (*HAND_BODIES, "part0"):
        spec.add_sensor(name=f"{body}_force", objtype=mujoco.mjtObj.mjOBJ_BODY, objname=body, **contacts)
    # XBODY: the body with all that it carries.
    spec.add_sensor(
        name="grip", objtype=mujoco.mjtObj.mjOBJ_XBODY, objname="hand",
        reftype=mujoco.mjtObj.mjOBJ_BODY, refname="part0", **contacts,
    )  # fmt: skip
    return spec.compile()


def _add_part(spec: mujoco.MjSpec, name: str, part: Part, physics: MujocoPhysics) -> None:
    body = spec.worldbody.add_body(name=name, explicitinertial=True)
    body.add_freejoint(name=name)
    body.mass = part.mass
    body.ipos = [0, 0, 0]  # where it is not set, MuJoCo ignores `iquat`, too
    body.iquat = part.quat_obj_principal
    body.inertia = part.principal_inertia
    contact = _contact(physics, physics.friction_table_part)
    mesh = trimesh.load_mesh(part.mesh_path)
    spec.add_mesh(
        name=f"{name}_mesh",
        uservert=np.asarray(mesh.vertices, dtype=float).ravel(),
        userface=np.asarray(mesh.faces, dtype=np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        needsdf=physics.collision == "sdf",
    )
    seen = dict(meshname=f"{name}_mesh", group=SEEN, rgba=_PART_COLOUR)
    if physics.collision == "sdf":
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SDF, **seen, **contact)
        return
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, contype=0, conaffinity=0, **seen)
    for i, corners in enumerate(hull_corners(part)):
        spec.add_mesh(
            name=f"{name}_hull{i}",
            uservert=corners.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
        )
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{name}_hull{i}", group=HIDDEN, **contact)


def _contact(physics: MujocoPhysics, friction: float) -> dict:
    return dict(contype=OTHERS, conaffinity=OTHERS, condim=3, friction=[friction, 0, 0], **stiff(physics))
