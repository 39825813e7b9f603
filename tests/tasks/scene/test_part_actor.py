"""Parts in PhysX: hulls, mass, inertia, rest, and room beside them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
import trimesh
from sapien.physx import PhysxRigidDynamicComponent
from scipy.spatial.transform import Rotation

from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES, PAD_REACH, pose_base_grasp
from mskgrasp.parts import find_part
from tasks.scene.part_actor import add_part

PARTS = ("hex_bolt_m20x50", "hex_nut_m30", "l_bracket_60x40", "parallel_key_a16x10x56", "spur_gear_m3_z17")


@pytest.mark.parametrize("name", PARTS)
def test_mass_and_inertia_are_those_of_the_mesh(env, name):
    part = find_part(name)
    env.reset(seed=1, options=dict(parts=[name], reconfigure=True))
    body = env.part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    assert len(body.collision_shapes) == part.n_hulls
    assert body.mass == pytest.approx(part.mass, rel=1e-5)
    assert np.asarray(body.inertia) == pytest.approx(part.principal_inertia, rel=1e-4)
    assert np.abs(body.cmass_local_pose.p).max() < 1e-7


@pytest.mark.parametrize("name", PARTS)
def test_no_hull_lost_a_corner_in_physx(env, name):
    env.reset(seed=1, options=dict(parts=[name], reconfigure=True))
    body = env.part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    cooked = np.concatenate([np.asarray(shape.vertices) * shape.scale for shape in body.collision_shapes])
    stored = trimesh.load(find_part(name).hulls_path).geometry.values()
    vertices = np.concatenate([mesh.vertices for mesh in stored]) * 1e-3
    assert len(cooked) == len(vertices)
    assert np.abs(cooked.min(axis=0) - vertices.min(axis=0)).max() < 1e-6
    assert np.abs(cooked.max(axis=0) - vertices.max(axis=0)).max() < 1e-6


@pytest.mark.parametrize("name", PARTS)
def test_parts_lie_still_where_they_are_placed(env, name):
    for seed in range(5):
        options = dict(parts=[name], reconfigure=True) if seed == 0 else {}
        env.reset(seed=seed, options=options)
        placed = env.part_pose()
        env.motion.step(env.motion.n_steps(0.2))
        moved = (env.part_pose().position - placed.position).norm()
        assert float(moved) < 2e-4


@pytest.mark.parametrize(
    "name", [PARTS[0], *(pytest.param(name, marks=pytest.mark.slow) for name in PARTS[1:])]
)
def test_a_descent_with_room_for_the_fingers_never_collides(env, name):
    """Points on the part's surface against the fingers' sweep, 2 mm larger all around, and the palm."""
    part = find_part(name)
    points = trimesh.sample.sample_surface(trimesh.load_mesh(part.mesh_path), 4000, seed=0)[0]
    rng = np.random.default_rng(0)
    free = 0
    for seed in range(20):
        env.reset(seed=seed, options=dict(parts=[name], reconfigure=True) if seed == 0 else {})
        pose = env.part_pose().as_vector()[0].double().numpy()
        grasp = np.array([*(pose[:2] + rng.uniform(-0.01, 0.01, 2)), 0.0105, rng.uniform(-1.5, 1.5)])
        seen = pose_base_grasp(grasp).inverse().apply(Pose.from_vector(pose).apply(points))
        # A finger is 22 mm wide at most and reaches from 40 mm to 66 mm from the middle when open.
        beside = (np.abs(seen[:, 0]) < 0.013) & (np.abs(seen[:, 1]) > 0.038) & (seen[:, 2] > -PAD_REACH)
        # The palm is 37 mm above the TCP: a tall part meets it when it is grasped low.
        if beside.any() or (seen[:, 2] > 0.035).any():
            continue
        free += 1
        outcome = env.attempt.run(torch.as_tensor(grasp[None], dtype=torch.float32))
        assert FAILURES[int(outcome["failure"][0])] != "collided"
    assert free >= 3


@pytest.mark.parametrize("name", ["l_bracket_60x40", "hinge_60x30"])
def test_the_axes_of_inertia_are_those_of_the_mesh(env, name):
    """Parts whose principal axes are turned against those of their mesh file."""
    part = find_part(name)
    env.reset(seed=1, options=dict(parts=[name], reconfigure=True))
    body = env.part._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    mesh = trimesh.load_mesh(part.mesh_path)
    mesh.density = part.mass / mesh.volume
    turn = Rotation.from_quat(body.cmass_local_pose.q, scalar_first=True).as_matrix()
    tensor = turn @ np.diag(body.inertia) @ turn.T
    scale = np.abs(mesh.moment_inertia).max()
    assert np.abs(tensor - mesh.moment_inertia).max() < 1e-3 * scale
    assert np.abs(tensor - np.diag(np.diag(tensor))).max() > 0.05 * scale


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(n_hulls=2), r"PhysX took 1 of 2 hulls and 100.00% of their volume; delete .* make it again"),
        (dict(hulls_volume=24.1e-6), r"PhysX took 1 of 1 hulls and 99.5\d% of their volume"),
    ],
)
def test_a_body_that_is_not_the_part_is_refused(env, boxes, place, changes, message):
    """A block of 24 cm^3; PhysX drops hulls and corners without a word."""
    place("light")
    wrong = dataclasses.replace(boxes["light"], name="wrong", **changes)
    with pytest.raises(BadPart, match=f"part 'wrong': .*{message}") as caught:
        add_part(env.scene, wrong, 0, 0.5)
    assert "\n" not in str(caught.value)


def test_the_friction_of_a_part_is_that_of_its_shapes(env, boxes, place):
    place("light")
    body = add_part(env.scene, dataclasses.replace(boxes["light"], name="rough"), 0, 0.37)
    component = body._objs[0].find_component_by_type(PhysxRigidDynamicComponent)
    for shape in component.collision_shapes:
        material = shape.physical_material
        assert (material.static_friction, material.dynamic_friction) == pytest.approx((0.37, 0.37))
        assert material.restitution == 0
