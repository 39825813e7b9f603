"""Certified grasps: their frames, their expected error, and their file."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.core.errors import BadPart
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply
from mskgrasp.core.grasp import pose_base_tcp
from mskgrasp.parts import find_part
from mskgrasp.planning.certified import (
    FILE,
    CertifiedGrasp,
    CertifiedGrasps,
    half_turned,
    radius_about_vertical,
    read_certified,
    rest_frame,
    to_base,
    to_rest,
    turned,
)

PART = find_part("hex_nut_m20")
angles = st.floats(-3.1, 3.1)
places = st.floats(-0.2, 0.2)


def certified_grasp(**changes) -> CertifiedGrasp:
    values = dict(
        resting=0,
        grasp=np.array([0.001, -0.002, 0.0105, 0.3]),
        n=24,
        lifted=23,
        mean=np.array([1e-4, 2e-3, -1e-4, 0.02]),
        slope=np.zeros((4, 3)),
        residual=np.diag(np.square([1e-4, 2e-5, 1e-4, 1e-3])),
        swing=np.array([0.001, -0.002]),
        swing_cov=1e-6 * np.eye(2),
        spread_error=0.0,
    )
    return CertifiedGrasp(**(values | changes))


def certified(*grasps: CertifiedGrasp, **changes) -> CertifiedGrasps:
    values = dict(
        part=PART.name,
        part_hash=PART.content_hash,
        grasps=grasps,
        uncertified=(),
        without={2: "it is rare (probability 1.0%)"},
        like={1: (0, 0.5)},
        stands=(True,) * len(PART.resting_probability),
        conditions=dict(seed=0, pose_errors=dict(position=3e-4, height=2e-4, turn=5e-3)),
    )
    return CertifiedGrasps(**(values | changes))


@given(angles, places, places, angles, places, places, st.floats(0.0105, 0.1))
def test_a_grasp_holds_the_part_alike_wherever_it_lies(turn, x, y, theta, gx, gy, gz):
    quat = PART.resting.quat_wxyz[0]
    height = PART.resting.position[0, 2]
    grasp = np.array([gx, gy, gz, theta])
    pads = []
    for place, facing in ((np.zeros(2), 0.0), (np.array([x, y]), turn)):
        pose = Pose(
            position=np.array([*place, height]),
            quat_wxyz=quat_multiply(quat_about_z(np.asarray(facing)), quat),
        )
        frame = rest_frame(pose, quat)
        in_base = to_base(frame, grasp, table_z=0.0)
        assert np.allclose(to_rest(frame, in_base)[:3], grasp[:3], atol=1e-9)
        sign = half_turned(frame, grasp, in_base)
        # Points of the pads, and of the part, seen from each other.
        points = pose_base_tcp(in_base).apply(np.array([[0.0, sign * 0.04, 0.0], [sign * 0.01, 0.0, 0.0]]))
        pads.append(pose.inverse().apply(points))
    assert np.allclose(*pads, atol=1e-9)


def test_a_rest_frame_turns_with_the_part_and_with_the_offset():
    quat = PART.resting.quat_wxyz[1]
    pose = Pose(
        position=np.array([0.4, 0.1, 0.02]), quat_wxyz=quat_multiply(quat_about_z(np.asarray(0.7)), quat)
    )
    frame = turned(rest_frame(pose, quat), -0.2)
    assert frame.apply(np.array([0.1, 0.0, 0.0])) == pytest.approx(
        [0.4 + 0.1 * np.cos(0.5), 0.1 + 0.1 * np.sin(0.5), 0.0]
    )


def test_the_expected_error_adds_up_what_the_pose_and_the_grasp_leave_unknown():
    slope = np.zeros((4, 3))
    slope[0, 0] = 1.0  # along the pads the part stays where it is
    grasp = certified_grasp(slope=slope, swing=np.zeros(2), swing_cov=np.zeros((2, 2)))
    pose_cov = np.diag(np.square([3e-4, 5e-4, 0.01]))
    assert grasp.score(pose_cov, radius=0.02) == pytest.approx(
        3e-4**2 + 1e-4**2 + 2e-5**2 + 1e-4**2 + (0.02 * 1e-3) ** 2
    )
    tilted = dataclasses.replace(grasp, swing=np.array([0.03, 0.0]))
    assert tilted.score(pose_cov, 0.02) - grasp.score(pose_cov, 0.02) == pytest.approx((0.02 * 0.03) ** 2)


def test_the_radius_of_a_disc_is_its_own():
    # A nut lying flat is about a ring: r^2 = (inner^2 + outer^2) / 2.
    flat = int(np.argmin(PART.resting.position[:, 2]))
    assert 0.010 < radius_about_vertical(PART, flat) < 0.0155


def test_the_file_gives_back_what_was_written(tmp_path):
    tilting = certified_grasp(resting=2, swing=np.array([0.2, 0.0]))
    written = certified(certified_grasp(), certified_grasp(resting=3, lifted=24), uncertified=(tilting,))
    written.write(tmp_path)
    read = read_certified(PART, tmp_path)
    assert [one.to_json() for one in read.grasps] == [one.to_json() for one in written.grasps]
    assert (read.without, read.like, read.stands) == (written.without, written.like, written.stands)
    grasps, turn = read.of(1)
    assert (len(grasps), turn) == (1, 0.5)  # pose 1 is pose 0, turned
    assert read.of(2) == ([], 0.0) and read.uncertified_of(1) == ([], 0.5)
    assert [one.to_json() for one in read.uncertified_of(2)[0]] == [tilting.to_json()]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(schema_version=9), r"written by another version of mskgrasp \(schema version 9"),
        (dict(part_hash="0"), "another version of"),
        (dict(hand={}), "another hand"),
        (dict(grasps=[{}]), "is damaged"),
        (dict(grasps=7), "is damaged"),
        (dict(stands=[True]), r"is damaged \(the part has \d+ resting poses\)"),
        (dict(like={"1": [99, 0.0]}), r"is damaged \(the part has \d+ resting poses\)"),
        (dict(like={"1": [0, "nan"]}), r"is damaged \(like must hold indices and finite turns\)"),
        (dict(like={"1": [0.5, 0.0]}), r"is damaged \(like must hold indices and finite turns\)"),
        (dict(like={"1": [0, 10**400]}), r"is damaged \(1.* is too large\)"),
        (dict(stands="t" * len(PART.resting_probability)), r"is damaged \(stands must be true or false\)"),
        (dict(conditions={}), r"is damaged \('pose_errors'\)"),
        (
            dict(conditions=dict(pose_errors=dict(position=-1.0, turn=0.0))),
            r"is damaged \(pose_errors must be",
        ),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_a_line(tmp_path, change, message):
    certified(certified_grasp()).write(tmp_path)
    values = json.loads((tmp_path / FILE).read_text())
    (tmp_path / FILE).write_text(json.dumps(values | change))
    with pytest.raises(BadPart, match=message) as caught:
        read_certified(PART, tmp_path)
    assert "\n" not in str(caught.value) and "mskgrasp.assess" in str(caught.value)


@pytest.mark.parametrize("value", [float("nan"), 1e400])
def test_a_value_that_is_no_number_is_refused(tmp_path, value):
    certified(certified_grasp()).write(tmp_path)
    values = json.loads((tmp_path / FILE).read_text())
    values["grasps"][0]["mean"][2] = value
    (tmp_path / FILE).write_text(json.dumps(values))
    with pytest.raises(BadPart, match=r"is damaged \((NaN|Infinity) is no number of JSON\)"):
        read_certified(PART, tmp_path)
    values["grasps"][0]["mean"][2] = str(value)
    (tmp_path / FILE).write_text(json.dumps(values))
    with pytest.raises(BadPart, match="mean must be finite"):
        read_certified(PART, tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(residual=(-1e-8 * np.eye(4)).tolist()), "residual is no covariance"),
        (dict(swing_cov=[[1e-6, 1e-6], [0.0, 1e-6]]), "swing_cov is no covariance"),
        (dict(resting=0.5), "resting, lifted and n must be integers"),
        (dict(n=0, lifted=0), "resting, lifted or n is out of range"),
    ],
)
def test_a_grasp_whose_values_cannot_be_is_refused_in_a_line(tmp_path, change, message):
    certified(certified_grasp()).write(tmp_path)
    values = json.loads((tmp_path / FILE).read_text())
    values["grasps"][0] |= change
    (tmp_path / FILE).write_text(json.dumps(values))
    with pytest.raises(BadPart, match=message) as caught:
        read_certified(PART, tmp_path)
    assert "\n" not in str(caught.value)


def test_a_part_without_certified_grasps_is_told_how_to_get_them(tmp_path):
    with pytest.raises(BadPart, match="python -m mskgrasp.assess hex_nut_m20"):
        read_certified(PART, tmp_path)
