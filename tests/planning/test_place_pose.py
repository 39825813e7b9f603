"""The hand is sent where the part in it, as it moved, lands on its target."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hal.errors import MotionAborted, OutOfWorkspace
from mskgrasp.core.geometry import Pose, quat_about_z, wrap_angle
from mskgrasp.core.grasp import Grasp, PartView, centre_in_grasp_frame, lowest_grasp_z, pose_base_grasp
from mskgrasp.planning.place_pose import (
    Target,
    carry_height,
    displacement_of_point,
    drop_of,
    place,
    place_error,
    place_pose,
)
from tests.hal.replay.toy import DOWN, toy_cell
from tests.planning.workspaces import WORKSPACE

near = st.floats(-0.04, 0.04)
lowest = WORKSPACE.lowest_grasp_z
angle = st.floats(-3.0, 3.0)


def moved_in_hand(grasp: np.ndarray, part: Pose, displacement: np.ndarray) -> Pose:
    """The part in the hand, as a pose in the grasp frame, after (dx, dy, dz, dtheta)."""
    held = pose_base_grasp(grasp).inverse() @ part
    turn = Pose(position=np.zeros(3), quat_wxyz=quat_about_z(np.asarray(displacement[3])))
    turned = turn @ Pose(position=np.zeros(3), quat_wxyz=held.quat_wxyz)
    return Pose(position=held.position + displacement[:3], quat_wxyz=turned.quat_wxyz)


@settings(deadline=None)  # a busy machine
@given(near, near, angle, near, near, st.floats(-1.0, 1.0), near, near, angle)
def test_a_part_whose_displacement_is_known_lands_on_its_target(dx, dy, yaw, cx, cy, dtheta, tx, ty, turn):
    part = Pose(position=np.array([0.5 + cx, cy, 0.02]), quat_wxyz=quat_about_z(np.asarray(yaw)))
    grasp = np.array([0.5, 0.0, 0.03, 0.4])
    displacement = np.array([dx, dy, 0.001, dtheta])
    target = Target(x=0.55 + tx, y=ty, theta=turn)
    pose = place_pose(Grasp.from_vector(grasp), displacement, part.position, target, lowest)
    placed = pose.T_base_grasp @ moved_in_hand(grasp, part, displacement)
    missed, off = place_error(part, placed, np.zeros(2), target)
    assert missed < 1e-9 and off < 1e-7


def test_without_correction_the_part_misses_by_its_displacement():
    part = Pose(position=np.array([0.5, 0.0, 0.02]), quat_wxyz=np.array([1.0, 0, 0, 0]))
    grasp, displacement = np.array([0.51, 0.0, 0.03, 0.0]), np.array([0.003, 0.004, 0.0, 0.1])
    target = Target(x=0.6, y=0.1, theta=np.pi / 2)
    pose = place_pose(Grasp.from_vector(grasp), np.zeros(4), part.position, target, lowest)
    placed = pose.T_base_grasp @ moved_in_hand(grasp, part, displacement)
    missed, off = place_error(part, placed, np.zeros(2), target)
    assert missed == pytest.approx(0.005) and off == pytest.approx(0.1)


@settings(deadline=None)  # a busy machine
@given(near, near, near, near, st.floats(-1.0, 1.0))
def test_points_of_a_part_move_with_it(px, py, dx, dy, dtheta):
    origin, point = np.array([0.01, -0.02, 0.0]), np.array([px, py, 0.0])
    displacement = np.array([dx, dy, 0.0, dtheta])
    moved = displacement_of_point(displacement, origin, point)
    cos, sin = np.cos(dtheta), np.sin(dtheta)
    away = point - origin
    expected = origin + displacement[:3] + [cos * away[0] - sin * away[1], sin * away[0] + cos * away[1], 0]
    np.testing.assert_allclose(point + moved[:3], expected, atol=1e-12)
    assert moved[3] == dtheta


def test_the_seen_centre_counts_where_it_is_not_the_origin():
    part = Pose(position=np.array([0.5, 0.0, 0.02]), quat_wxyz=quat_about_z(np.asarray(0.7)))
    offset = np.array([0.004, -0.002])
    centre = part.position + np.append(offset, 0.0)
    grasp, displacement = np.array([0.49, 0.01, 0.03, -0.3]), np.array([0.002, -0.001, 0.0, 0.2])
    target = Target(x=0.58, y=-0.05, theta=1.0)
    of_centre = displacement_of_point(
        displacement, centre_in_grasp_frame(part.position, grasp), centre_in_grasp_frame(centre, grasp)
    )
    pose = place_pose(Grasp.from_vector(grasp), of_centre, centre, target, lowest)
    placed = pose.T_base_grasp @ moved_in_hand(grasp, part, displacement)
    missed, off = place_error(part, placed, offset, target)
    assert missed < 1e-9 and off < 1e-9


def test_the_hand_stays_above_the_table_and_follows_a_part_that_sank():
    grasp, centre = np.array([0.5, 0.0, 0.03, 0.0]), np.array([0.5, 0.0, 0.02])
    target = Target(x=0.5, y=0.0, theta=0.0)
    sunk = place_pose(Grasp.from_vector(grasp), np.array([0, 0, -0.004, 0]), centre, target, lowest)
    assert sunk.position[2] == pytest.approx(0.03 + 0.004 + 0.002)
    risen = place_pose(
        Grasp.from_vector(np.array([0.5, 0, 0.0106, 0])), np.array([0, 0, 0.005, 0]), centre, target, lowest
    )
    assert risen.position[2] == lowest_grasp_z(0.0)
    assert wrap_angle(sunk.theta) == sunk.theta


def test_on_a_slope_the_hand_stays_above_the_table_where_it_places():
    slope = dataclasses.replace(WORKSPACE, table_slope=(0.02, 0.0))
    grasp = Grasp.from_vector(np.array([0.5, 0.0, 0.0125, 0.0]))
    low, high = (
        place_pose(grasp, np.zeros(4), np.array([0.5, 0, 0.01]), target, slope.lowest_grasp_z)
        for target in (Target(x=0.4, y=0.0, theta=0.0), Target(x=0.7, y=0.0, theta=0.0))
    )
    assert low.position[2] == pytest.approx(0.0125 + 0.002 - 0.1 * 0.02)
    assert high.position[2] == pytest.approx(0.0125 + 0.002 + 0.2 * 0.02)
    target, risen = Target(x=0.7, y=0.0, theta=0.0), np.array([0.0, 0.0, 0.01, 0.0])
    lowest = place_pose(grasp, risen, np.array([0.5, 0, 0.01]), target, slope.lowest_grasp_z)
    assert lowest.position[2] == pytest.approx(float(slope.lowest_grasp_z(np.array([0.7, 0.0]))))


def seen_box(yaw: float, height: float) -> PartView:
    """A box of 80 x 30 mm that lies turned by yaw."""
    return PartView(
        centre_base=np.array([0.5, 0.02, height / 2]),
        T_base_box=Pose(position=np.array([0.5, 0.02, 0.0]), quat_wxyz=quat_about_z(np.asarray(yaw))),
        size=np.array([0.08, 0.03, height]),
        gyration_radius=0.02,
        table_z=0.0,
    )


@given(angle, st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-0.5, 0.5), st.floats(0.005, 0.06))
def test_a_tilted_part_is_let_go_where_its_lowest_corner_nearly_touches(yaw, sx, sy, turn, height):
    view, grasp = seen_box(yaw, height), Grasp.from_vector(np.array([0.51, 0.02, 0.03, 0.3]))
    displacement = np.array([0.001, 0.0, -0.002, turn])
    drop = drop_of(grasp, view, turn, np.array([sx, sy]))
    target = Target(x=0.5, y=0.0, theta=0.0)
    pose = place_pose(grasp, displacement, view.centre_base, target, lowest, drop=drop)
    corners = np.stack(np.meshgrid(*([-0.5, 0.5],) * 3), axis=-1).reshape(-1, 3)
    to_grasp = grasp.T_base_grasp.inverse()
    in_grasp = to_grasp.apply(view.T_base_box.apply(corners * view.size + [0, 0, height / 2]))
    centre = to_grasp.apply(view.centre_base)
    rotation = (Rotation.from_rotvec([sx, sy, 0.0]) * Rotation.from_euler("z", turn)).as_matrix()
    held = centre + displacement[:3] + (in_grasp - centre) @ rotation.T
    assert pose.T_base_grasp.apply(held)[:, 2].min() == pytest.approx(0.002, abs=1e-9)


def test_an_unknown_swing_drops_nothing():
    view, grasp = seen_box(0.2, 0.02), Grasp.from_vector(np.array([0.51, 0.02, 0.03, 0.3]))
    assert drop_of(grasp, view, 0.1, np.full(2, np.nan)) == drop_of(grasp, view, 0.1, np.zeros(2)) == 0


class WritingCell:
    """Notes where the hand is sent; it stands at a height over (0.4, 0)."""

    def __init__(self, z: float):
        cell = toy_cell()
        cell.arm.connect()
        start = Pose(position=np.array([0.4, 0.0, z]), quat_wxyz=DOWN)
        cell.arm.move_to_pose(start)
        self.seen: list[list[float]] = []
        self.speeds: list[float] = []
        self.cell, move = cell, cell.arm.move_to_pose

        def noted(T_base_tcp: Pose, *, speed: float = 0.1) -> None:
            self.seen.append(np.asarray(T_base_tcp.position).round(4).tolist())
            self.speeds.append(speed)
            move(T_base_tcp, speed=speed)

        cell.arm.move_to_pose = noted


def recover(error: MotionAborted) -> None:
    raise error


@pytest.mark.parametrize(
    ("z", "tallest", "carried"),
    [
        (0.06, 0.0, 0.12),  # low parts: as ever
        (0.06, 0.04, 0.12),
        (0.06, 0.1, 0.175),  # the part reaches 6 cm below the TCP, and passes 15 mm over the others
        (0.15, 0.0, 0.17),
        (0.15, 0.16, 0.325),
    ],
)
def test_a_part_is_carried_over_the_tallest_thing(z: float, tallest: float, carried: float):
    pose = Grasp.from_vector(np.array([0.5, 0.2, z, 0.0]))
    assert carry_height(toy_cell(), pose, tallest) == pytest.approx(carried)


def test_a_tall_part_rises_before_it_goes_aside_and_the_hand_leaves_over_it():
    """Lifted to 16 cm; a filled slot is 16 cm high."""
    bench = WritingCell(0.16)
    pose = Grasp.from_vector(np.array([0.5, 0.2, 0.06, 0.0]))
    place(bench.cell, pose, recover, tallest=0.16, part_height=0.18)
    assert bench.seen == [
        [0.4, 0.0, 0.235],  # 16 cm, the part's 6 cm, and 15 mm
        [0.5, 0.2, 0.235],
        [0.5, 0.2, 0.08],
        [0.5, 0.2, 0.06],
        [0.5, 0.2, 0.2045],  # over the part itself
    ]


def test_a_low_part_goes_straight_aside_and_slowly_over_the_last_20_mm():
    bench = WritingCell(0.16)
    place(bench.cell, Grasp.from_vector(np.array([0.5, 0.2, 0.06, 0.0])), recover, tallest=0.03)
    assert bench.seen == [[0.5, 0.2, 0.12], [0.5, 0.2, 0.08], [0.5, 0.2, 0.06], [0.5, 0.2, 0.12]]
    assert bench.speeds == [0.25, 0.25, 0.1, 0.25]


def test_a_tall_part_that_hangs_just_over_its_place_is_lowered_slowly_all_the_way():
    bench = WritingCell(0.19)
    place(bench.cell, Grasp.from_vector(np.array([0.5, 0.2, 0.15, 0.0])), recover)
    assert bench.seen == [[0.5, 0.2, 0.17], [0.5, 0.2, 0.15], [0.5, 0.2, 0.17]]


def test_the_part_may_be_measured_at_its_place_before_the_fingers_open():
    bench = WritingCell(0.16)
    there: list[float] = []

    def arrived() -> None:
        there.extend(np.asarray(bench.cell.arm.state().T_base_tcp.position))
        bench.seen.append([])

    pose = Grasp.from_vector(np.array([0.5, 0.2, 0.06, 0.0]))
    place(bench.cell, pose, recover, tallest=0.03, arrived=arrived)
    assert there == pytest.approx([0.5, 0.2, 0.057])  # 1 mm lower than it was grasped, where nothing is met
    assert bench.seen == [[0.5, 0.2, 0.12], [0.5, 0.2, 0.08], [0.5, 0.2, 0.06], [], [0.5, 0.2, 0.12]]


@pytest.mark.parametrize(
    ("z", "drop", "released"),
    [
        (0.06, 0.0, 0.057),
        (0.06, 0.006, 0.051),  # it hangs less low than was expected
        (0.06, 0.02, 0.05),  # met: the toy's table
        (0.051, 0.0, 0.05),
    ],
)
def test_a_part_is_lowered_until_it_touches(z: float, drop: float, released: float):
    bench, there = WritingCell(0.16), []
    arrived = lambda: there.append(float(bench.cell.arm.state().T_base_tcp.position[2]))  # noqa: E731
    place(bench.cell, Grasp.from_vector(np.array([0.5, 0.2, z, 0.0])), recover, drop=drop, arrived=arrived)
    assert there == pytest.approx([released])


def test_a_part_that_was_grasped_low_is_not_lowered_until_the_pads_touch():
    bench, there = WritingCell(0.16), []
    bench.cell = dataclasses.replace(
        bench.cell, workspace=dataclasses.replace(bench.cell.workspace, table_z=0.05)
    )
    low = float(bench.cell.workspace.lowest_grasp_z(np.array([0.5, 0.2])))
    arrived = lambda: there.append(float(bench.cell.arm.state().T_base_tcp.position[2]))  # noqa: E731
    place(bench.cell, Grasp.from_vector(np.array([0.5, 0.2, low + 0.002, 0.0])), recover, arrived=arrived)
    assert there == pytest.approx([low])


@pytest.mark.parametrize(
    ("error", "recovered"),
    [(MotionAborted("the reflex was quicker"), 1), (OutOfWorkspace("contact force 5 N is not under 4 N"), 0)],
)
def test_a_part_that_is_not_lowered_to_the_touch_is_released_where_it_is(
    error: Exception, recovered: int, monkeypatch: pytest.MonkeyPatch
):
    bench, errors = WritingCell(0.16), []

    def refuse(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(bench.cell.arm, "move_until_contact", refuse)
    place(bench.cell, Grasp.from_vector(np.array([0.5, 0.2, 0.06, 0.0])), errors.append)
    assert len(errors) == recovered and bench.cell.arm.state().gripper_width > 0.05


def test_a_place_over_which_the_part_cannot_be_carried_is_refused_before_anything_moves():
    bench = WritingCell(0.16)
    pose = Grasp.from_vector(np.array([0.5, 0.2, 0.06, 0.0]))
    with pytest.raises(OutOfWorkspace):
        place(bench.cell, pose, recover, tallest=0.95)
    assert bench.seen == []
