"""The engine against outcomes that can be worked out on paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hal.config import READY
from hal.mujoco.config import MujocoPhysics
from hal.mujoco.simulation import Simulation
from mskgrasp.core.geometry import Pose, pose_distance
from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH
from mskgrasp.core.panda_kinematics import forward_pose, top_down
from mskgrasp.parts import find_part
from mskgrasp.parts.solids import shape as h
from mskgrasp.validate.body_scene import Workshop
from tests.hal.mujoco.conftest import MakeBox, held, never, on_table

MM = 1e-3
MU = MujocoPhysics().friction_pad_part
G = 9.81


def in_hand(simulation: Simulation) -> Pose:
    return forward_pose(simulation.joints).inverse() @ simulation.part_pose()


def shift(simulation: Simulation, wrench: list[float], seconds: float = 0.2) -> tuple[float, float]:
    """How far, and by which angle, a part moves in the hand under a force, N, and a moment, N m, in base."""
    before = in_hand(simulation)
    body = simulation.model.body("part0").id
    simulation.data.xfrc_applied[body] = wrench
    simulation.stand(seconds, stop=never)
    simulation.data.xfrc_applied[body] = 0
    return pose_distance(before, in_hand(simulation))


def test_a_part_in_free_fall_falls_by_half_g_t_squared(box: MakeBox):
    simulation = on_table(box((0.03, 0.02, 0.04), 0.05))
    simulation.data.qpos[11] = 0.5
    simulation.data.qvel[9:] = 0
    seconds = 0.2
    simulation.stand(seconds, stop=never)
    fallen = 0.5 - simulation.part_pose().position[2]
    # Symplectic steps of h add g t h / 2.
    assert fallen == pytest.approx(G * seconds**2 / 2, abs=1.1 * G * seconds * simulation.step_s / 2)


def test_a_part_at_the_top_of_a_throw_is_not_at_rest(box: MakeBox):
    """The arm moves through air meanwhile, which is not simulated while all parts are at rest."""
    simulation = on_table(box((0.03, 0.02, 0.04), 0.05))
    n_up = 40
    simulation.data.qvel[11] = G * n_up * simulation.step_s
    simulation.stand(n_up * simulation.step_s, stop=never)
    assert np.abs(simulation.data.qvel[9:]).max() < 1e-3 and simulation.part_pose().position[2] > 0.025
    away = np.array(READY) + [0.3, 0, 0, 0, 0, 0, 0]
    assert simulation.follow(np.linspace(READY, away, simulation.n_steps(0.5)), stop=never)
    assert simulation.part_pose().position[2] == pytest.approx(0.02, abs=0.02 * MM)


def test_parts_on_very_many_points_do_not_fall_through_the_table():
    """What MuJoCo has no memory for it leaves out: every contact, with a warning in a file."""
    gear = find_part("spur_gear_m2_z18")
    flat = int(np.argmin(gear.resting.position[:, 2]))
    z, quat = gear.resting.position[flat, 2], gear.resting.quat_wxyz[flat]
    poses = [
        Pose(position=np.array([0.35 + 0.06 * (k % 6), 0.06 * (k // 6) - 0.15, z]), quat_wxyz=quat)
        for k in range(24)
    ]
    simulation = Simulation(MujocoPhysics(), [gear] * len(poses), poses, np.array(READY))
    simulation.stand(0.01, stop=never)
    assert simulation.data.ncon > 1500 and not simulation.data.warning.number.any()
    heights = [simulation.part_pose(k).position[2] for k in range(len(poses))]
    np.testing.assert_allclose(heights, z, atol=1e-4)


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6])
def test_a_sliding_block_stops_after_v_squared_over_two_mu_g(box: MakeBox, friction: float):
    flat = box((0.06, 0.06, 0.01), 0.2)
    simulation = on_table(flat, MujocoPhysics(friction_table_part=friction), x=0.4)
    speed = 0.5
    simulation.data.qvel[9] = speed
    simulation.stand(speed / (friction * G) + 0.1, stop=never)
    assert simulation.part_pose().position[0] - 0.4 == pytest.approx(speed**2 / (2 * friction * G), rel=0.02)
    assert np.abs(simulation.data.qvel[9:]).max() < 1e-3


def test_a_part_rests_in_the_table_by_less_than_a_fiftieth_of_a_millimetre(box: MakeBox):
    simulation = on_table(box((0.03, 0.02, 0.04), 0.05))
    assert simulation.part_pose().position[2] == pytest.approx(0.02, abs=0.02 * MM)


@pytest.mark.parametrize("force", [10.0, 40.0])
def test_pads_hold_up_to_twice_mu_times_the_grip(box: MakeBox, force: float):
    """Straight down, and across: one limit for every direction in the plane of the pads."""
    block = box((0.03, 0.02, 0.04), 0.05)
    limit, weight = 2 * MU * force, 0.05 * G
    for share, holds in ((0.95, True), (1.05, False)):
        down = [0, 0, -(share * limit - weight), 0, 0, 0]
        across = [np.sqrt((share * limit) ** 2 - weight**2), 0, 0, 0, 0, 0]
        for wrench in (down, across):
            moved, _ = shift(held(block, force=force), wrench)
            assert (moved < 0.05 * MM) == holds


@pytest.mark.parametrize(("width", "overlap"), [(17.5, 18.5), (10.0, 2.0), (2.0, 2.0), (2.0, 1.0)])
def test_the_moment_that_pads_hold_is_that_of_their_contact(box: MakeBox, width: float, overlap: float):
    """The pads' lower ends hold a box by its upper end, so that their contact is a rectangle, mm.

    Even pressure holds 2 mu F times the mean distance from the centre. Contacts at the corners of four pieces
    hold more, but no pressure holds as much as all of it at the corners of the rectangle.
    """
    contact = np.array([width, overlap]) * MM
    x, y = (np.linspace(-0.5, 0.5, 401) * edge for edge in contact)
    even = 2 * MU * 20.0 * float(np.hypot(*np.meshgrid(x, y)).mean())
    most = 2 * MU * 20.0 * float(np.hypot(*contact)) / 2
    block = box((max(contact[0], 2 * MM), 0.02, 0.04), 0.02)

    def turned(moment: float) -> float:
        simulation = held(block, height=0.04 + PAD_REACH - contact[1])
        return shift(simulation, [0, 0, 0, 0, moment, 0])[1]

    assert turned(0.95 * even) < 0.01
    assert turned(min(1.35 * even, most) if width > 2 else most) > 0.1


def test_pads_that_touch_at_one_point_resist_turning_by_the_radius_of_their_patch(tmp_path: Path):
    """A slab with a pyramid's tip at each pad: 2 mu F r, as the forces have no lever."""
    slab = [(x, y, z) for x in (-15, 15) for y in (-6, 6) for z in (-15, 15)]
    tips = Workshop(tmp_path).part("tips", h.convex(np.array([*slab, (0, -10, 0), (0, 10, 0)], float)), 0.02)
    limit = 2 * MU * 20.0 * MujocoPhysics().pad_patch_radius
    assert shift(held(tips, height=0.015), [0, 0, 0, 0, 0.8 * limit, 0])[1] < 0.01
    assert shift(held(tips, height=0.015), [0, 0, 0, 0, 1.1 * limit, 0])[1] > 0.1


def test_the_pads_leave_what_they_hold_at_once(box: MakeBox):
    simulation = held(box((0.03, 0.02, 0.04), 0.05))
    began = simulation.data.time
    simulation.move_fingers(MAX_OPENING, force=None, stop=never)
    ramp = (MAX_OPENING - 0.03) / (2 * simulation.physics.finger_speed)
    assert simulation.width == pytest.approx(MAX_OPENING, abs=MM)
    assert simulation.data.time - began < ramp + 0.3


def test_a_held_part_does_not_creep(box: MakeBox):
    """MuJoCo's friction is soft: without its iterations against slip, parts sink out of the hand."""
    simulation = held(box((0.03, 0.02, 0.04), 0.4))
    moved, turned = shift(simulation, [0] * 6, seconds=3.0)
    assert moved < 0.002 * MM and turned < 1e-4


@pytest.mark.parametrize("force", [10.0, 40.0])
def test_a_sheet_of_two_millimetres_is_felt(box: MakeBox, force: float):
    simulation = held(box((0.04, 0.002, 0.03), 0.02), force=force)
    assert simulation.width == pytest.approx(2 * MM, abs=0.15 * MM)
    assert simulation.part_pose().position[2] == pytest.approx(0.115, abs=0.2 * MM)


def test_the_contacts_that_mujoco_has_by_default_lose_it(box: MakeBox):
    """Why they are not used: pads sink by a millimetre, and the sheet counts as nothing."""
    soft = MujocoPhysics(contact_time_s=0.02, contact_impedance=(0.9, 0.95, 0.001))
    assert held(box((0.04, 0.002, 0.03), 0.02), soft, force=40.0).width < 1.2 * MM


@pytest.mark.parametrize("offset", [6 * MM, -11 * MM])
def test_a_box_off_centre_ends_centred_and_level(box: MakeBox, offset: float):
    """The displacement in the hand is known: minus the offset along the closing direction, else nothing."""
    simulation = held(box((0.03, 0.02, 0.04), 0.1), y=offset)
    tcp, part = forward_pose(simulation.joints), simulation.part_pose()
    assert part.position[1] - tcp.position[1] == pytest.approx(0.0, abs=0.1 * MM)
    assert part.position[[0, 2]] == pytest.approx([0.5, 0.12], abs=0.2 * MM)
    assert abs(part.quat_wxyz[0]) == pytest.approx(1.0, abs=1e-5)


def test_the_grip_is_no_load_but_what_pulls_at_the_part_is(box: MakeBox):
    """Each pad feels 40 N; the weight of a part is no contact, and the table is one as soon as it is met."""
    simulation = held(box((0.03, 0.02, 0.04), 0.05), force=40.0)
    assert simulation.load() < 0.01
    joints = np.array([simulation.target, *_down(0.104, 1000)])
    assert not simulation.follow(joints, stop=never)  # 4 mm into the table
    assert simulation.physics.reflex_force < simulation.load() < 2 * simulation.physics.reflex_force


def _down(way: float, n: int) -> np.ndarray:
    """Joints (n, 7) on the way down from 12 cm."""
    return np.array(
        [top_down(np.array([0.5, 0.0, 0.12 - way * share, 0.0]))[0] for share in np.arange(1, n + 1) / n]
    )


@pytest.mark.parametrize("step_s", [0.0005, 0.001])
def test_the_reflex_depends_on_the_mean_force_and_not_on_the_step(box: MakeBox, step_s: float):
    """A part is set down at 10 cm/s and slides through the pads with 2 mu F, 40 N.

    The mean over 24 ms passes 20 N after half that time, in which the hand sinks by 1.2 mm.
    """
    simulation = held(box((0.03, 0.02, 0.04), 0.05), MujocoPhysics(step_s=step_s), force=40.0)
    path = _down(0.104, simulation.n_steps(1.04))
    assert not simulation.follow(np.array([simulation.target, *path]), stop=never)
    height = forward_pose(simulation.joints).position[2]
    assert height == pytest.approx(0.02 - 1.2 * MM, abs=0.25 * MM)


@pytest.mark.slow
def test_signed_distances_of_the_mesh_give_the_outcome_of_its_convex_pieces():
    """A nut, whose pieces are exact: the hand finds the same width with either shape."""
    nut, widths = find_part("hex_nut_m30"), []
    position = np.array([0.5, 0.0, nut.resting.position[0, 2]])
    for collision in ("hulls", "sdf"):
        pose = Pose(position=position, quat_wxyz=nut.resting.quat_wxyz[0])
        simulation = Simulation(MujocoPhysics(collision=collision), [nut], [pose], np.array(READY))
        simulation.data.qpos[:7] = simulation.target = top_down(np.array([0.5, 0.0, 0.0115, 0.0]))[0]
        simulation.move_fingers(-0.08, force=20.0, stop=never)
        widths.append(simulation.width)
    assert widths[0] == pytest.approx(widths[1], abs=0.2 * MM)
