"""The compiled model holds the parts and the settings it was given."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import trimesh

from hal.mujoco.config import MujocoPhysics
from hal.mujoco.panda import HAND_BODIES, HIDDEN, SEEN
from hal.mujoco.scene import build_model
from mskgrasp.core.settings import TABLE_Z
from mskgrasp.parts import Part, find_part
from tests.hal.mujoco.conftest import MakeBox, held, on_table

PHYSICS = MujocoPhysics(friction_pad_part=0.35, friction_table_part=0.45)
HEAVY = 0.4
G = 9.81


@pytest.fixture(scope="module")
def bracket() -> Part:
    """Of several hulls, its principal axes not those of its mesh."""
    return find_part("l_bracket_60x40")


@pytest.fixture(scope="module")
def model(bracket: Part) -> mujoco.MjModel:
    return build_model(PHYSICS, [bracket, find_part("hex_nut_m30")])


def test_mass_centre_and_inertia_are_those_of_the_mesh(model: mujoco.MjModel, bracket: Part):
    mesh = trimesh.load_mesh(bracket.mesh_path)
    mesh.density = bracket.mass / mesh.volume
    body = model.body("part0")
    assert body.mass[0] == pytest.approx(mesh.mass, rel=1e-6)
    assert body.ipos == pytest.approx(np.zeros(3), abs=1e-9)  # the obj frame is at the centroid
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    turn = turn.reshape(3, 3)
    assert turn @ np.diag(body.inertia) @ turn.T == pytest.approx(mesh.moment_inertia, rel=1e-3, abs=1e-9)


def geoms(model: mujoco.MjModel, body: str) -> list[int]:
    return np.flatnonzero(model.geom_bodyid == model.body(body).id).tolist()


def test_a_part_is_seen_by_its_mesh_and_touched_by_its_hulls(model: mujoco.MjModel, bracket: Part):
    every = geoms(model, "part0")
    seen = [i for i in every if model.geom_group[i] == SEEN]
    touched = [i for i in every if model.geom_contype[i]]
    assert len(seen) == 1 and not set(seen) & set(touched)
    assert len(touched) == bracket.n_hulls > 1
    assert all(model.geom_group[i] == HIDDEN for i in touched)
    # MuJoCo moves each mesh to its own centre: together they must still span the part.
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    corners = []
    for i in touched:
        mesh = model.geom_dataid[i]
        first, n = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        local = model.mesh_vert[first : first + n]
        corners.append(local @ data.geom_xmat[i].reshape(3, 3).T + data.geom_xpos[i])
    spanned = np.ptp(np.concatenate(corners), axis=0)
    assert spanned == pytest.approx(bracket.extents, abs=2e-4)


def test_signed_distances_take_the_place_of_the_hulls(box: MakeBox):
    model = build_model(MujocoPhysics(collision="sdf"), [box((0.03, 0.02, 0.04), 0.05)])
    (only,) = geoms(model, "part0")
    assert model.geom_type[only] == mujoco.mjtGeom.mjGEOM_SDF and model.geom_contype[only]


def test_the_first_part_is_the_one_that_is_grasped_and_all_are_free(model: mujoco.MjModel):
    assert [model.body(f"part{i}").jntnum[0] for i in range(2)] == [1, 1]
    assert [int(model.joint(f"part{i}").qposadr[0]) for i in range(2)] == [9, 16]
    assert model.body("part1").mass[0] == pytest.approx(find_part("hex_nut_m30").mass, rel=1e-6)


def test_options_are_those_of_the_settings(model: mujoco.MjModel):
    assert model.opt.timestep == PHYSICS.step_s and model.opt.iterations == PHYSICS.solver_iterations
    assert model.opt.noslip_iterations == PHYSICS.noslip_iterations
    assert model.opt.gravity == pytest.approx([0, 0, -G])
    assert model.geom("table").pos[2] == TABLE_Z


def frictions(simulation, body: str) -> set[float]:
    """Of the contacts between the part and a body."""
    model, data = simulation.model, simulation.data
    found = set()
    for i in range(data.ncon):
        names = {model.body(model.geom_bodyid[geom]).name for geom in data.contact[i].geom}
        if names == {"part0", body}:
            found.add(round(float(data.contact[i].friction[0]), 6))
    return found


def test_each_pair_of_surfaces_has_its_own_friction(box: MakeBox):
    part = box((0.03, 0.02, 0.04), 0.05)
    assert frictions(on_table(part, PHYSICS), "world") == {0.45}
    gripped = held(part, PHYSICS, force=20.0)
    assert frictions(gripped, "left_finger") == frictions(gripped, "right_finger") == {0.35}


def test_a_sensor_counts_the_contacts_of_each_body_and_sums_their_forces(box: MakeBox):
    """On the table a part presses with its weight; in the hand the grip cancels but for the weight."""
    part = box((0.03, 0.02, 0.04), HEAVY)
    standing, gripped = on_table(part), held(part)

    def sensed(simulation, name: str) -> np.ndarray:
        return simulation.data.sensor(name).data

    names = [standing.model.sensor(i).name for i in range(standing.model.nsensor)]
    assert names == [*(f"{body}_force" for body in (*HAND_BODIES, "part0")), "grip"]
    assert sensed(standing, "part0_force")[0] >= 1 and sensed(standing, "grip")[0] == 0
    assert sensed(standing, "part0_force")[1:] == pytest.approx([0, 0, -HEAVY * G], abs=0.02)
    assert sensed(gripped, "grip")[0] >= 2
    left, right = (sensed(gripped, f"{side}_finger_force") for side in ("left", "right"))
    assert abs(left[2]) == pytest.approx(20.0, rel=0.05) and left[2] * right[2] < 0  # along base y
    assert left[3] + right[3] == pytest.approx(HEAVY * G, rel=0.01)
