"""Calls as plain values, and back."""

from __future__ import annotations

import inspect
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hal import Arm, ArmState, Camera, GraspOutcome, errors
from hal.cell import PartFeeder, PartTracker
from hal.errors import HalError, MotionAborted, Stopped
from hal.replay.events import COMMANDS, arm_state, plain, pose, rebuild
from mskgrasp.core.errors import BadPart, MskgraspError
from mskgrasp.core.geometry import Pose

finite = st.floats(-10, 10)


@given(position=arrays(np.float64, 3, elements=finite), quat_wxyz=arrays(np.float64, 4, elements=finite))
def test_a_pose_survives_json_to_the_bit(position: np.ndarray, quat_wxyz: np.ndarray):
    written = json.loads(json.dumps(plain(Pose(position=position, quat_wxyz=quat_wxyz))))
    assert len(written) == 7 and written[:3] == position.tolist() and written[3:] == quat_wxyz.tolist()
    read = pose(written)
    assert np.array_equal(read.position, position) and np.array_equal(read.quat_wxyz, quat_wxyz)


@given(
    joints=arrays(np.float64, 7, elements=finite), width=st.floats(0, 0.08),
    grasped=st.sampled_from([True, False, None]),
)  # fmt: skip
def test_a_state_survives_json_with_a_time_of_its_own(joints: np.ndarray, width: float, grasped: bool | None):
    here = Pose(position=joints[:3], quat_wxyz=np.array([0.0, 1.0, 0.0, 0.0]))
    state = ArmState(
        joints=joints, T_base_tcp=here, gripper_width=width, timestamp_s=5.0, grasped=grasped, max_width=0.07
    )
    read = arm_state(json.loads(json.dumps(plain(state))), 7.5)
    assert np.array_equal(read.joints, joints) and read.gripper_width == width and read.timestamp_s == 7.5
    assert np.array_equal(read.T_base_tcp.as_vector(), here.as_vector())
    assert read.grasped is grasped and read.max_width == 0.07


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (GraspOutcome(width=np.float64(0.03), holding=np.bool_(True)), {"width": 0.03, "holding": True}),  # type: ignore[arg-type]
        (np.float32(0.5), 0.5),
        (np.array([[1, 2]]), [[1, 2]]),
        ("nut", "nut"),
        (None, None),
    ],
)
def test_what_a_cell_gives_and_takes_is_plain(value: object, expected: object):
    assert plain(value) == expected
    json.dumps(plain(value))


KINDS = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, MskgraspError)]


@pytest.mark.parametrize("kind", [*KINDS, BadPart], ids=lambda kind: kind.__name__)
def test_an_error_is_raised_again_as_what_it_was(kind: type[MskgraspError]):
    again = rebuild((kind.__name__, "contact; recover()"))
    assert type(again) is kind and str(again) == "contact; recover()"


def test_what_cannot_be_raised_again_is_an_error_of_the_cell():
    """Ctrl-C must not end the program that plays it back; a defect of then is an error of the recording."""
    assert isinstance(rebuild(("KeyboardInterrupt", "")), Stopped)
    unknown = rebuild(("ZeroDivisionError", "division by zero"))
    assert type(unknown) is HalError and not isinstance(unknown, MotionAborted)
    assert str(unknown) == "division by zero"


def test_every_command_is_a_method_of_a_device_and_every_motion_of_an_arm_a_command():
    methods = {
        name
        for kind in (Arm, Camera, PartFeeder, PartTracker)
        for name, _ in inspect.getmembers(kind, inspect.isfunction)
        if not name.startswith("_")
    }
    assert set(COMMANDS) <= methods
    queries = {"state", "in_hand", "check_pose", "part_pose", "stop", "connect", "close"}
    queries |= {"check_joints", "check_load", "hand", "holds", "legs"}
    queries |= {"set_load", "slow_down"}  # move nothing: a recording without them accepts one
    assert methods - queries == set(COMMANDS)
