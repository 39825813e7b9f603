"""The exported file has the fields of the format, and hand poses that hold the part."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import Pose, quat_about_z, quat_to_matrix
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.core.panda_kinematics import TCP_OFFSET
from mskgrasp.planning.isaac_grasp import (
    read_isaac_grasp,
    top_down_grasp,
    write_isaac_grasp,
    write_scored,
)
from tests.planning.test_certified import PART, certified, certified_grasp


def test_a_hand_stands_over_the_part_with_its_fingers_down(tmp_path):
    grasp = certified_grasp()
    write_isaac_grasp(tmp_path / "grasps.yaml", PART, certified(grasp))
    values = yaml.safe_load((tmp_path / "grasps.yaml").read_text())
    assert (values["format"], values["format_version"]) == ("isaac_grasp", 1.0)
    assert list(values["grasps"]) == ["grasp_0_pose_0", "grasp_0_pose_1"]
    found = values["grasps"]["grasp_0_pose_0"]
    assert found["confidence"] == pytest.approx(24 / 26, abs=1e-4)
    assert found["pregrasp_cspace_position"]["panda_finger_joint1"] == pytest.approx(0.04)
    quat = np.array([found["orientation"]["w"], *found["orientation"]["xyz"]])
    hand = Pose(position=np.array(found["position"]), quat_wxyz=quat)
    lying = Pose(
        position=np.array([0.0, 0.0, PART.resting.position[0, 2]]), quat_wxyz=PART.resting.quat_wxyz[0]
    )
    # Between the pads, in the frame of the table: the grasp point, and the hand above it.
    between = (lying @ hand).apply(np.array([0.0, 0.0, TCP_OFFSET]))
    assert between == pytest.approx(grasp.grasp[:3], abs=1e-9)
    assert (lying @ hand).position[2] == pytest.approx(grasp.grasp[2] + TCP_OFFSET)
    across = (lying @ hand).apply(np.array([0.0, 1.0, 0.0])) - (lying @ hand).position
    theta = grasp.grasp[3]
    assert abs(across @ [-np.sin(theta), np.cos(theta), 0.0]) == pytest.approx(1.0)
    # The displacement is along the grasp's axes, which the file names by the hand's.
    axes = quat_to_matrix((lying @ hand).quat_wxyz) * [1, -1, -1]
    assert values["displacement_axes"].startswith("x, -y, -z of panda_hand")
    assert axes == pytest.approx(quat_to_matrix(quat_about_z(np.asarray(theta))), abs=1e-9)
    assert found["displacement"] == pytest.approx(grasp.mean)


def test_a_grasp_is_written_for_every_pose_that_looks_alike(tmp_path):
    """The nut lies on either face; its rest frame in the second pose is turned by half a radian."""
    grasp = certified_grasp()
    write_isaac_grasp(tmp_path / "grasps.yaml", PART, certified(grasp))
    read = read_isaac_grasp(tmp_path / "grasps.yaml")
    second = [number == 1 for number in range(len(PART.resting_probability))]
    turned = top_down_grasp(PART, read.T_mesh_tcp["grasp_0_pose_1"], second)
    assert turned is not None and turned.tilt == pytest.approx(0.0, abs=1e-6)
    (x, y), (c, s) = grasp.grasp[:2], (np.cos(0.5), np.sin(0.5))
    assert turned.grasp == pytest.approx([c * x - s * y, s * x + c * y, grasp.grasp[2], grasp.grasp[3] + 0.5])


def test_the_covariance_is_that_of_a_part_whose_pose_is_seen_with_errors(tmp_path):
    slope = np.zeros((4, 3))
    slope[0, 0] = 1.0  # along the pads the part stays where it really was
    write_isaac_grasp(tmp_path / "grasps.yaml", PART, certified(certified_grasp(slope=slope)))
    found = yaml.safe_load((tmp_path / "grasps.yaml").read_text())["grasps"]["grasp_0_pose_0"]
    assert found["displacement"] == pytest.approx([1e-4, 2e-3, -1e-4, 0.02])
    deviation = np.sqrt(np.diag(found["displacement_cov"]))
    # The residual, the errors of the pose that the grasp was certified for, and the simulation's own.
    expected = [np.sqrt(1e-4**2 + 3e-4**2 + 5e-5**2), np.hypot(2e-5, 5e-5), np.hypot(1e-4, 5e-5)]
    assert deviation == pytest.approx([*expected, np.hypot(1e-3, np.radians(0.1))])


@pytest.mark.parametrize("link", ["panda_hand", "panda_hand_tcp"])
def test_a_written_grasp_is_read_as_it_was(link, tmp_path):
    grasps = [certified_grasp(), certified_grasp(grasp=np.array([0.001, 0.002, 0.012, -1.4]))]
    path = tmp_path / "grasps.yaml"
    write_isaac_grasp(path, PART, certified(*grasps))
    if link == "panda_hand_tcp":
        values = yaml.safe_load(path.read_text())
        for one in values["grasps"].values():
            quat = np.array([one["orientation"]["w"], *one["orientation"]["xyz"]])
            hand = Pose(position=np.array(one["position"]), quat_wxyz=quat)
            one["position"] = hand.apply(np.array([0.0, 0.0, TCP_OFFSET])).tolist()
        path.write_text(yaml.safe_dump(values | {"gripper_frame_link": link}))
    read = read_isaac_grasp(path)
    own = [pose for name, pose in read.T_mesh_tcp.items() if name.endswith("pose_0")]
    for pose, grasp in zip(own, grasps, strict=True):
        found = top_down_grasp(PART, pose, [True] + [False] * (len(PART.resting_probability) - 1))
        assert found is not None and found.resting == 0 and found.sign == 1.0
        assert found.grasp == pytest.approx(grasp.grasp, abs=1e-9)
        assert found.tilt == pytest.approx(0.0, abs=1e-6)


def lying(grasp: np.ndarray, tilt: float = 0.0) -> Pose:
    """Pose of the TCP in the part, tilted about its x, for a grasp in the rest frame of pose 0."""
    T_table_obj = Pose(
        position=np.array([0.0, 0.0, PART.resting.position[0, 2]]), quat_wxyz=PART.resting.quat_wxyz[0]
    )
    turned = Pose(position=np.zeros(3), quat_wxyz=np.array([np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]))
    return T_table_obj.inverse() @ pose_base_tcp(grasp) @ turned


def test_a_hand_turned_by_half_a_turn_is_the_same_grasp_with_reversed_axes():
    found = top_down_grasp(PART, lying(np.array([0.0, 0.0, 0.0105, 0.3 + np.pi])))
    assert found is not None and found.grasp[3] == pytest.approx(0.3) and found.sign == -1.0


def test_a_grasp_that_is_top_down_in_no_resting_pose_is_none():
    first = [True] + [False] * (len(PART.resting_probability) - 1)
    assert top_down_grasp(PART, lying(np.array([0.0, 0.0, 0.0105, 0.3]), np.radians(4))) is not None
    assert top_down_grasp(PART, lying(np.array([0.0, 0.0, 0.0105, 0.3]), np.radians(7)), first) is None
    assert top_down_grasp(PART, lying(np.array([0.0, 0.0, 0.005, 0.3])), first) is None


def test_scored_grasps_keep_all_else_and_the_others_are_left_out(tmp_path):
    path, scored = tmp_path / "grasps.yaml", tmp_path / "scored.yaml"
    write_isaac_grasp(path, PART, certified(certified_grasp(), certified_grasp(resting=2)))
    before = yaml.safe_load(path.read_text())
    write_scored(scored, read_isaac_grasp(path), {"grasp_1_pose_2": dict(confidence=0.25)})
    after = yaml.safe_load(scored.read_text())
    expected = before["grasps"]["grasp_1_pose_2"] | {"confidence": 0.25}
    assert after == before | {"grasps": {"grasp_1_pose_2": expected}}


def test_grasps_that_are_numbered_are_scored_too(tmp_path):
    path, scored = tmp_path / "grasps.yaml", tmp_path / "scored.yaml"
    write_isaac_grasp(path, PART, certified(certified_grasp(), certified_grasp(resting=2)))
    values = yaml.safe_load(path.read_text())
    values["grasps"] = dict(enumerate(values["grasps"].values()))
    path.write_text(yaml.safe_dump(values))
    write_scored(scored, read_isaac_grasp(path), {"1": dict(confidence=0.25)})
    assert yaml.safe_load(scored.read_text())["grasps"] == {1: values["grasps"][1] | {"confidence": 0.25}}


HERE = dict(position=[0.0, 0.0, 0.0], orientation=dict(w=1.0, xyz=[0.0, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(format="grasps"), "format is 'grasps', legal: 'isaac_grasp'"),
        (dict(gripper_frame_link="robotiq_base"), "gripper_frame_link is 'robotiq_base', legal: panda_hand"),
        (dict(gripper_frame_link=["panda_hand"]), r"gripper_frame_link is \['panda_hand'\], legal"),
        (dict(grasps={}), "holds no grasps"),
        (dict(format_version=2.0), "format_version is 2.0, legal: 1.0"),
        (dict(grasps={1: HERE, "1": HERE}), "two grasps are called 1; rename one"),
        (dict(grasps=dict(a=HERE | {"orientation": dict(w=0.0, xyz="100")})), "grasp 'a' has no pose: xyz"),
        (dict(grasps={"one": dict(position=[0, 0])}), "grasp 'one' has no pose"),
        (
            dict(grasps={"one": dict(position=[0, 0, 10**400], orientation=dict(w=1.0, xyz=[0, 0, 0]))}),
            "grasp 'one' has no pose",
        ),
        (
            dict(grasps={"one": dict(position=[0, 0, 0], orientation=dict(w=2.0, xyz=[0, 0, 0]))}),
            "grasp 'one' has no pose",
        ),
        (
            dict(grasps={"one": dict(position=[0, 0, 0], orientation=dict(w=float("nan"), xyz=[0, 0, 0]))}),
            "grasp 'one' has no pose",
        ),
    ],
)
def test_a_file_of_another_kind_is_refused_in_a_line(changes, message, tmp_path):
    path = tmp_path / "grasps.yaml"
    write_isaac_grasp(path, PART, certified(certified_grasp()))
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | changes))
    with pytest.raises(BadConfig, match=message):
        read_isaac_grasp(path)
