"""Capsules around the Panda, against the meshes of its links."""

from __future__ import annotations

from pathlib import Path

import mani_skill
import numpy as np
import pytest
import trimesh

from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import PAD_REACH, pose_base_tcp
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER, TCP_OFFSET, forward_pose, joint_frames

MESHES = Path(mani_skill.__file__).parent / "assets/robots/panda/franka_description/meshes/collision"
READY = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])


def outside(points: np.ndarray, frame: int) -> np.ndarray:
    """Distances (n,) of points (n, 3) in a frame from the capsules of that frame; negative inside."""
    found = []
    for one in PANDA_LINKS.capsules:
        if one.frame != frame:
            continue
        a, b = np.array(one.ends, dtype=np.float64)
        along = b - a
        share = np.clip((points - a) @ along / max(float(along @ along), 1e-12), 0, 1)
        found.append(np.linalg.norm(points - a - share[:, None] * along, axis=1) - one.radius)
    return np.min(found, axis=0)


@pytest.mark.parametrize("name", [*(f"link{k}" for k in range(1, 8)), "hand"])
def test_the_mesh_of_a_link_lies_inside_its_capsules(name: str):
    mesh = trimesh.load_mesh(MESHES / f"{name}.stl")
    sampled = trimesh.sample.sample_surface(mesh, 20000, seed=1)[0]
    points = np.vstack([mesh.vertices, sampled])
    if name == "hand":
        points = points - [0, 0, TCP_OFFSET]
    beyond = outside(points, 7 if name == "hand" else int(name[-1]) - 1)
    assert beyond.max() < 1e-3
    # And they are no wider than they need be: nowhere by more than a hand's breadth.
    assert beyond.min() > -0.12


def test_open_and_closed_fingers_lie_inside_their_capsules():
    """66 mm to either side when open, 11 mm wide, down to the tips of the pads."""
    corners = [[x, y, z] for x in (-0.011, 0.011) for y in (-0.066, 0.066, 0.0) for z in (-0.02, PAD_REACH)]
    assert outside(np.array(corners), 7).max() < 3e-3


def test_capsules_move_with_the_links_and_the_hand_with_the_tcp():
    first, second = PANDA_LINKS.segments(np.stack([READY, READY + 0.3]))
    assert first.shape == second.shape == (2, len(PANDA_LINKS.capsules), 3)
    tcp = forward_pose(READY)
    for number, one in enumerate(PANDA_LINKS.capsules):
        if one.frame == 7:
            assert first[0, number] == pytest.approx(tcp.apply(np.array(one.ends[0])), abs=1e-12)
    # The first link only turns about the base's axis.
    assert first[0, 0, 2] == pytest.approx(first[1, 0, 2]) == pytest.approx(0.333 - 0.164)


def test_frames_of_the_joints_are_those_of_the_documented_parameters():
    """At zero the arm stands upright: shoulder at 0.333 m, elbow 0.316 m higher, wrist 0.384 m more."""
    frames = joint_frames(np.zeros(7))
    heights = [frame[2, 3] for frame in frames]
    assert heights == pytest.approx([0.333, 0.333, 0.649, 0.649, 1.033, 1.033, 1.033, 1.033 - 0.2104])


def test_no_point_moves_farther_than_the_bound_says():
    rng = np.random.default_rng(0)
    reach = PANDA_LINKS.reach()
    for _ in range(200):
        start = rng.uniform(JOINT_LOWER, JOINT_UPPER)
        goal = start + rng.normal(0, 0.2, 7)
        ends = [PANDA_LINKS.segments(joints) for joints in (start, goal)]
        moved = np.max([np.linalg.norm(b - a, axis=-1) for a, b in zip(*ends, strict=True)], axis=0)
        assert (moved <= np.abs(goal - start) @ reach + 1e-9).all()


def test_joints_of_a_pose_bring_the_hand_there():
    target = pose_base_tcp(np.array([0.5, 0.1, 0.1, 0.3]))
    reached = forward_pose(PANDA_LINKS.joints_at(target))
    assert isinstance(reached, Pose) and reached.position == pytest.approx(target.position, abs=1e-6)
