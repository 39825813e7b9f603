"""Motions past posts, boxes and the camera: none is passed through, and a free way is left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hal.collisions import Clearances, check_joints, check_path, line_joints
from hal.errors import OutOfWorkspace
from hal.keep_out import Box, Capsule, camera_keep_out
from hal.simulated import panda_limits
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import JOINT_LOWER, JOINT_UPPER, forward_pose
from mskgrasp.core.settings import Overhead

READY = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
CAMERA = camera_keep_out(Overhead().T_base_camera((0.5, 0.0)))


def post(x: float, y: float, radius: float = 0.02) -> Capsule:
    return Capsule(name="post", ends=np.array([[x, y, 0.0], [x, y, 1.2]]), radius=radius)


def checked(path: list[np.ndarray], *keep_out) -> None:
    check_path(PANDA_LINKS, replace(panda_limits(), keep_out=keep_out), np.stack(path), "the way")


def turned(angle: float) -> np.ndarray:
    """Ready, turned about the base's axis by an angle in degrees."""
    return READY + np.array([np.radians(angle), 0, 0, 0, 0, 0, 0])


def test_a_thin_post_between_two_free_poses_is_not_passed_through():
    """A wire of 2 mm beside the arm: both ends of the turn are far from it."""
    wire = post(0.2, 0.26, radius=0.001)
    for end in (-60, 100):
        check_joints(PANDA_LINKS, replace(panda_limits(), keep_out=(wire,)), turned(end))
    with pytest.raises(OutOfWorkspace, match=r"the way brings the \w+ .* mm .*'post' \(at least 20 mm\)"):
        checked([turned(-60), turned(100)], wire)
    checked([turned(-60), turned(10)], wire)


def test_a_message_names_link_obstacle_and_distance_in_one_line():
    """The wrist stands 117 mm from a camera 0.8 m over the middle of the region."""
    near = Capsule(name="lamp", ends=CAMERA.ends - [0.115, 0, 0], radius=CAMERA.radius)
    with pytest.raises(OutOfWorkspace, match=r"the wrist within 1?\d mm of 'lamp' \(at least") as found:
        check_joints(PANDA_LINKS, replace(panda_limits(), keep_out=(near,)), READY)
    assert "\n" not in str(found.value)
    check_joints(PANDA_LINKS, replace(panda_limits(), keep_out=(near,)), READY, margin=0.0)


def test_forearm_and_wrist_keep_off_the_table():
    """The hand may lie flat over the table, where its corners are checked; the forearm may not."""
    low, limits = np.array([0.0, 1.7, 0.0, -0.3, 0.0, 1.9, 0.785]), replace(panda_limits(), table_z=0.25)
    with pytest.raises(OutOfWorkspace, match=r"the (wrist|forearm|elbow) .* the table"):
        check_path(PANDA_LINKS, limits, np.stack([READY, low]), "the way")
    grasp = PANDA_LINKS.joints_at(pose_base_tcp(np.array([0.62, 0.12, 0.0105, 0.0])))
    checked([READY, grasp])


@pytest.mark.slow
def test_no_random_motion_passes_through_what_a_hundred_times_finer_steps_meet():
    """What is accepted keeps a distance everywhere; what is refused is too near somewhere, or nearly."""
    rng = np.random.default_rng(0)
    limits = replace(
        panda_limits(),
        keep_out=(CAMERA, post(0.3, 0.35), Box(name="shelf", lower=np.array([-0.6, -0.7, 0.0]),
                                               upper=np.array([0.4, -0.5, 0.6]))),
    )  # fmt: skip
    clearances = Clearances.of(PANDA_LINKS, limits)
    accepted = 0
    for _ in range(60):
        start, goal = rng.uniform(JOINT_LOWER, JOINT_UPPER, (2, 7)) * 0.5 + READY * 0.5
        fine = start + np.linspace(0, 1, 2000)[:, None] * (goal - start)
        distances = clearances.at(fine)
        if (distances[0] < clearances.required).any():
            continue  # it may leave, but that is another property
        least = (distances - clearances.required).min()
        try:
            check_path(PANDA_LINKS, limits, np.stack([start, goal]), "the way")
            accepted += 1
            assert least > -0.006
        except OutOfWorkspace:
            assert least < 1e-6
    assert accepted > 4


def test_an_arm_that_stands_too_near_may_leave_but_come_no_nearer():
    """Guided by hand to 5 mm from a post."""
    first, second = PANDA_LINKS.segments(READY)
    hand = next(i for i, one in enumerate(PANDA_LINKS.capsules) if one.name == "hand")
    side = max(first[hand, 1], second[hand, 1]) + PANDA_LINKS.radii[hand]
    near = post(float(first[hand, 0]), side + 0.025)
    limits = replace(panda_limits(), keep_out=(near,))
    with pytest.raises(OutOfWorkspace):
        check_joints(PANDA_LINKS, limits, READY)
    checked([READY, turned(-20)], near)
    with pytest.raises(OutOfWorkspace, match="the hand"):
        checked([READY, turned(3)], near)


def test_the_joints_of_a_line_keep_the_hand_on_it():
    start, goal = forward_pose(READY), pose_base_tcp(np.array([0.6, -0.1, 0.1, 1.2]))
    path = line_joints(PANDA_LINKS, panda_limits(), READY, start, goal)
    assert path[0] == pytest.approx(READY) and np.abs(np.diff(path, axis=0)).max() < 0.25
    shares = np.linspace(0, len(path) - 1, 500)
    fine = np.stack([np.interp(shares, np.arange(len(path)), column) for column in path.T], axis=1)
    on_line = forward_pose(fine).position
    along = (goal.position - start.position) / np.linalg.norm(goal.position - start.position)
    off = on_line - start.position
    aside = np.linalg.norm(off - (off @ along)[:, None] * along, axis=1)
    assert aside.max() < 2e-3 and forward_pose(path[-1]).position == pytest.approx(goal.position, abs=1e-4)


def test_a_line_out_of_reach_is_refused():
    far = Pose(position=np.array([1.2, 0.0, 0.3]), quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))
    with pytest.raises(OutOfWorkspace, match="no straight line from here"):
        line_joints(PANDA_LINKS, panda_limits(), READY, forward_pose(READY), far)


def test_a_turn_beyond_a_joints_limit_is_refused():
    """From the ready pose the last joint has 2.1 rad to one side and 3.7 rad to the other."""
    here, limits = forward_pose(READY), panda_limits()
    one, other = (
        Pose(position=here.position, quat_wxyz=quat_multiply(quat_about_z(np.array(angle)), here.quat_wxyz))
        for angle in (-2.8, 2.8)
    )
    with pytest.raises(OutOfWorkspace, match="within the joint limits; move to other joints first"):
        line_joints(PANDA_LINKS, limits, READY, here, one)
    path = line_joints(PANDA_LINKS, limits, READY, here, other)
    assert ((limits.joint_lower <= path) & (path <= limits.joint_upper)).all()
    assert (
        line_joints(PANDA_LINKS, replace(limits, joint_upper=limits.joint_upper + 1), READY, here, one)[-1, 6]
        > 2.9
    )
