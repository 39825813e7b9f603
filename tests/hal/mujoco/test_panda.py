"""The model of the Panda against what is published, and against kinematics that know nothing of MuJoCo."""

from __future__ import annotations

from pathlib import Path

import mani_skill
import mujoco
import numpy as np
import pytest
import trimesh

from hal.mujoco.config import MujocoPhysics
from hal.mujoco.panda import FINGER, HAND, LINKS, TORQUE_LIMIT
from hal.mujoco.scene import build_model
from mskgrasp.core.grasp import FINGER_HALF_WIDTH, FINGER_THICKNESS, PAD_REACH, PALM_HEIGHT
from mskgrasp.core.panda_kinematics import DH_A, DH_ALPHA, DH_D, JOINT_LOWER, JOINT_UPPER, forward
from mskgrasp.parts import find_part

HAND_MESH = "assets/robots/panda/franka_description/meshes/collision/hand.stl"


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return build_model(MujocoPhysics(), [find_part("hex_nut_m30")])


def test_link_inertias_are_those_of_bodies():
    """Positive, and no principal moment exceeds the sum of the others."""
    for link in (*LINKS, HAND, FINGER):
        moments = np.linalg.eigvalsh(link.matrix())
        assert moments[0] > 0 and moments[2] <= moments[:2].sum() + 1e-9


def test_masses_sum_to_the_published_ones(model: mujoco.MjModel):
    """Gaz et al. 2019: links 1 to 7 have 16.06 kg; the Franka Hand has 0.73 kg and two fingers of 15 g."""
    arm = sum(model.body(f"link{i}").mass[0] for i in range(1, 8))
    assert arm == pytest.approx(16.062, abs=1e-3)
    hand = sum(model.body(name).mass[0] for name in ("hand", "left_finger", "right_finger"))
    assert hand == pytest.approx(0.76, abs=1e-6)


def test_the_tcp_is_where_the_denavit_hartenberg_parameters_put_it(model: mujoco.MjModel):
    rng = np.random.default_rng(0)
    data = mujoco.MjData(model)
    for _ in range(20):
        joints = rng.uniform(JOINT_LOWER, JOINT_UPPER)
        data.qpos[:7] = joints
        mujoco.mj_forward(model, data)
        expected, site = forward(joints)[0], data.site("tcp")
        assert site.xpos == pytest.approx(expected[:3, 3], abs=1e-9)
        assert site.xmat.reshape(3, 3) == pytest.approx(expected[:3, :3], abs=1e-9)


def test_gravity_torques_are_the_slope_of_the_potential_energy(model: mujoco.MjModel):
    """The energy is summed up from the published masses and centres, link by link."""
    hand_z = 0.107
    lumps = [(link.mass, np.array([*link.centre, 1.0])) for link in LINKS]
    c, s = np.cos(np.pi / 4), np.sin(np.pi / 4)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])  # the hand is turned by -45 degrees
    at_hand = [(HAND.mass, turn @ HAND.centre), (2 * FINGER.mass, np.array([0, 0, 0.0584]))]
    held = [(mass, np.array([x, y, z + hand_z, 1.0])) for mass, (x, y, z) in at_hand]

    def energy(joints: np.ndarray) -> float:
        frame, total = np.eye(4), 0.0
        for i in range(7):
            ca, sa, ct, st = np.cos(DH_ALPHA[i]), np.sin(DH_ALPHA[i]), np.cos(joints[i]), np.sin(joints[i])
            frame = frame @ np.array(
                [
                    [ct, -st, 0, DH_A[i]],
                    [st * ca, ct * ca, -sa, -DH_D[i] * sa],
                    [st * sa, ct * sa, ca, DH_D[i] * ca],
                    [0, 0, 0, 1],
                ]
            )
            for mass, centre in [lumps[i], *(held if i == 6 else [])]:
                total += 9.81 * mass * (frame @ centre)[2]
        return total

    rng = np.random.default_rng(1)
    data = mujoco.MjData(model)
    for _ in range(5):
        joints = rng.uniform(JOINT_LOWER, JOINT_UPPER)
        data.qpos[:7] = joints
        data.qpos[7:9] = 0.02
        mujoco.mj_forward(model, data)
        slope = [(energy(joints + 1e-6 * axis) - energy(joints - 1e-6 * axis)) / 2e-6 for axis in np.eye(7)]
        assert data.qfrc_bias[:7] == pytest.approx(slope, abs=1e-4)


def test_no_joint_gets_more_torque_than_the_real_one(model: mujoco.MjModel):
    data = mujoco.MjData(model)
    data.ctrl[:7] = 1000.0
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator[:7] == pytest.approx(TORQUE_LIMIT)


def test_the_palm_has_the_shape_of_the_hands_collision_mesh(model: mujoco.MjModel):
    """Where parts may come, below the flange: as long and as wide at every height, to 0.5 mm."""
    geom = next(i for i in range(model.ngeom) if model.body(model.geom_bodyid[i]).name == "hand")
    mine = trimesh.convex.convex_hull(_corners(model, geom))
    published = trimesh.load_mesh(Path(mani_skill.__file__).parent / HAND_MESH).convex_hull
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hand = data.body("hand")
    frame = hand.xmat.reshape(3, 3)
    mine.vertices = (
        data.geom_xpos[geom] + mine.vertices @ data.geom_xmat[geom].reshape(3, 3).T - hand.xpos
    ) @ frame
    for z in (0.01, 0.03, 0.05, 0.06, 0.063, 0.065):
        ours, theirs = (body.section([0, 0, 1], [0, 0, z]).bounds for body in (mine, published))
        assert ours[:, 0] == pytest.approx(theirs[:, 0], abs=5e-4)
        assert ours[1, 1] - ours[0, 1] == pytest.approx(theirs[1, 1] - theirs[0, 1], abs=3e-3)
    assert mine.bounds[1, 2] == pytest.approx(published.bounds[1, 2], abs=1e-4)


def test_the_hand_has_the_outline_that_planning_reckons_with(model: mujoco.MjModel):
    """Corners of all shapes, hand open, in the tcp frame."""
    data = mujoco.MjData(model)
    data.qpos[7:9] = 0.04
    mujoco.mj_forward(model, data)
    tcp = data.site("tcp")
    corners = {"hand": [], "left_finger": []}
    for i in range(model.ngeom):
        name = model.body(model.geom_bodyid[i]).name
        if name in corners:
            points = data.geom_xpos[i] + _corners(model, i) @ data.geom_xmat[i].reshape(3, 3).T
            corners[name].extend((points - tcp.xpos) @ tcp.xmat.reshape(3, 3))
    palm, finger = np.array(corners["hand"]), np.array(corners["left_finger"])
    assert palm[:, 2].max() == pytest.approx(-PALM_HEIGHT, abs=2e-4)
    assert finger[:, 2].max() == pytest.approx(PAD_REACH, abs=1e-4)
    assert np.abs(finger[:, 0]).max() == pytest.approx(FINGER_HALF_WIDTH, abs=1e-4)
    assert finger[:, 1].min() == pytest.approx(0.04, abs=1e-4)
    assert finger[:, 1].max() == pytest.approx(0.04 + FINGER_THICKNESS, abs=1e-3)


def _corners(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """(k, 3) corners of a box or mesh, in its own frame."""
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        return np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T * model.geom_size[geom]
    mesh = model.mesh(model.geom_dataid[geom])
    return model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]].astype(float)
