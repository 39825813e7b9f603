"""Plans of certified grasps on the simulated cell, and of the networks where there are none."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from hal import open_cell
from mskgrasp.core.errors import PartNotRecognised, TableTooHigh
from mskgrasp.core.geometry import wrap_half_turn
from mskgrasp.core.shipped import PRETRAINED, config_file
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.part_pose import KnownPart
from mskgrasp.planning.certified import radius_about_vertical, rest_frame, to_base
from mskgrasp.planning.certified_planner import (
    SIMULATED_ALIKE,
    CertifiedPlanner,
    planner_of_part,
    reachable_by,
)
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner
from mskgrasp.planning.plan_text import plan_text
from mskgrasp.planning.planner import Planner
from tests.perception.part_pose.cells import prepared
from tests.planning.test_certified import certified, certified_grasp

PART = find_part("l_bracket_60x40")


@pytest.fixture(scope="module", autouse=True)
def a_part_is_prepared_once() -> Iterator[None]:
    """Not anew by each planner that is made of it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(KnownPart, "of", prepared)
        yield


@pytest.fixture(scope="module")
def cell():
    with open_cell(config_file("cells/sapien.yaml")) as opened:
        yield opened


@pytest.fixture(scope="module")
def planner(cell) -> Planner:
    return make_planner(PRETRAINED, PlannerConfig(policy="certified", n_candidates=400), cell)


def grasps(resting: int, part: Part = PART):
    slope = np.zeros((4, 3))
    slope[0, 0] = 1.0
    sure = certified_grasp(
        resting=resting, grasp=np.array([0.005, -0.003, 0.0105, 0.4]), slope=slope,
        mean=np.array([1e-3, 2e-3, -1e-4, 0.1]), swing=np.zeros(2), swing_cov=1e-8 * np.eye(2),
    )  # fmt: skip
    poor = dataclasses.replace(sure, grasp=sure.grasp + [0, 0.01, 0, 0.5], residual=1e-5 * np.eye(4))
    return certified(
        poor, sure, part=part.name, part_hash=part.content_hash, like={}, without={},
        stands=(True,) * len(part.resting_probability),
    )  # fmt: skip


def present(cell, seed: int):
    cell.feeder.present(PART.name, seed)
    frame = cell.camera.capture()
    return frame, cell.tracker.part_pose()


def resting_of(true) -> int:
    """The resting pose whose height the part has, and whose up it has."""
    up = true.inverse().apply(np.array([0.0, 0.0, 1.0])) - true.inverse().apply(np.zeros(3))
    ups = [
        dataclasses.replace(PART.resting, position=np.zeros(3), quat_wxyz=quat)
        .inverse()
        .apply(np.array([0.0, 0.0, 1.0]))
        for quat in PART.resting.quat_wxyz
    ]
    return int(np.argmax([one @ up for one in ups]))


@pytest.mark.parametrize("seed", [0, 3, 8])
def test_the_surest_grasp_is_planned_where_the_part_lies(cell, planner, seed):
    frame, true = present(cell, seed)
    resting = resting_of(true)
    known = grasps(resting)
    own = CertifiedPlanner(planner, PART, known, reachable_by(cell))
    plan = own.plan(frame, np.random.default_rng(0))
    assert plan.certified and plan.pose is not None and plan.pose.resting == resting
    sure = known.grasps[1]
    expected = to_base(rest_frame(true, PART.resting.quat_wxyz[resting]), sure.grasp)
    assert np.linalg.norm(plan.grasp.position - expected[:3]) < 1e-3
    assert abs(wrap_half_turn(np.asarray(plan.grasp.theta - expected[3]))) < np.radians(1.5)
    # The part, displaced as planned, is where the certified grasp brings it.
    origin = np.asarray(plan.pose.T_base_obj.position)
    mean, covariance = plan.displacement_of(origin)
    sign = np.sign(mean[1])
    assert mean == pytest.approx(sure.mean * [sign, sign, 1, 1], abs=1e-9)
    along = plan.pose.covariance[:2, :2].max()
    least = sure.residual + SIMULATED_ALIKE
    assert least[0, 0] < covariance[0, 0] <= least[0, 0] + 2 * along
    assert np.isclose(covariance[1, 1], least[1, 1], rtol=1e-6)
    assert plan.quality == pytest.approx(24 / 26)


def test_a_table_seen_too_high_is_refused_as_by_the_networks(cell, planner):
    frame, true = present(cell, 0)
    noise = np.random.default_rng(0).normal(0, 2e-3, frame.depth.shape)
    high = dataclasses.replace(frame, depth=(frame.depth + noise - 2.5e-3).astype(np.float32))
    patient = copy.copy(planner)
    patient.min_height = 0.006
    own = CertifiedPlanner(patient, PART, grasps(resting_of(true)), reachable_by(cell))
    with pytest.raises(TableTooHigh, match=r"run hal\.touch"):
        own.plan(high, np.random.default_rng(0))


def test_a_camera_that_measures_too_far_does_not_lower_the_grasp(cell, planner):
    frame, true = present(cell, 3)
    noise = np.random.default_rng(0).normal(0, 1e-3, frame.depth.shape)
    far = dataclasses.replace(frame, depth=(frame.depth + noise + 2e-3).astype(np.float32))
    known = grasps(resting_of(true))
    raised = [dataclasses.replace(one, grasp=one.grasp + [0, 0, 0.01, 0]) for one in known.grasps]
    known = dataclasses.replace(known, grasps=tuple(raised))
    own = CertifiedPlanner(planner, PART, known, reachable_by(cell))
    exact, found = (own.plan(one, np.random.default_rng(0)) for one in (frame, far))
    assert found.certified and found.view.table_offset == pytest.approx(-2e-3, abs=3e-4)
    assert found.grasp.position == pytest.approx(exact.grasp.position, abs=1e-3)
    assert found.grasp.position[2] == exact.grasp.position[2]


def test_grasps_keep_their_height_over_a_table_that_slopes(cell, planner):
    frame, true = present(cell, 3)
    known = grasps(resting_of(true))
    raised = [dataclasses.replace(one, grasp=one.grasp + [0, 0, 0.01, 0]) for one in known.grasps]
    known = dataclasses.replace(known, grasps=tuple(raised))
    space = dataclasses.replace(cell.workspace, table_slope=(0.01, -0.005))
    sloping = Planner.of_workspace(planner.models, planner.config, space)
    level, found = (
        CertifiedPlanner(one, PART, known).plan(frame, np.random.default_rng(0)).grasp.position
        for one in (planner, sloping)
    )
    rise = (found[:2] - space.centre) @ space.table_slope
    assert found[:2] == pytest.approx(level[:2]) and abs(rise) > 2e-4
    assert found[2] - level[2] == pytest.approx(rise, abs=1e-9)


def test_grasps_too_near_to_the_table_for_the_cell_are_left_out_and_the_remedy_is_named(
    cell, planner, capsys
):
    frame, true = present(cell, 3)
    resting = resting_of(true)
    known = grasps(resting)
    poor, sure = known.grasps
    # The pads of the surest grasp are 1 mm over the table, those of the other one 3 mm.
    higher = dataclasses.replace(poor, grasp=poor.grasp + [0, 0, 2e-3, 0])
    cautious = Planner.of_workspace(
        planner.models, planner.config, dataclasses.replace(cell.workspace, clearance=3e-3)
    )
    both = dataclasses.replace(known, grasps=(sure, higher))
    plan = CertifiedPlanner(cautious, PART, both).plan(frame, np.random.default_rng(0))
    assert (
        plan.certified
        and plan.score > CertifiedPlanner(planner, PART, both).plan(frame, np.random.default_rng(0)).score
    )
    variances = np.diag(plan.displacement_cov)
    radius = radius_about_vertical(PART, resting)
    assert plan.score >= 0.999 * (variances[:3].sum() + radius**2 * variances[3])
    assert not capsys.readouterr().err
    plan = CertifiedPlanner(cautious, PART, known).plan(frame, np.random.default_rng(0))
    assert not plan.certified
    assert "keeps the cell's clearance from the table; assess the part with --clearance 0.003; " in (
        capsys.readouterr().err
    )


def test_grasps_out_of_reach_are_left_out(cell, planner):
    frame, true = present(cell, 1)
    own = CertifiedPlanner(planner, PART, grasps(resting_of(true)))
    best = own.plan(frame, np.random.default_rng(0)).grasp
    other = CertifiedPlanner(
        planner, PART, grasps(resting_of(true)), lambda grasp: bool(abs(grasp.theta - best.theta) > 0.1)
    )
    assert abs(other.plan(frame, np.random.default_rng(0)).grasp.theta - best.theta) > 0.1


def test_without_certified_grasps_the_networks_plan_and_say_why(cell, planner, capsys):
    frame, true = present(cell, 2)
    resting = resting_of(true)
    others = grasps((resting + 1) % len(PART.resting_probability))
    others = dataclasses.replace(others, without={resting: "no grasp lifts it"})
    plan = CertifiedPlanner(planner, PART, others).plan(frame, np.random.default_rng(0))
    assert not plan.certified and plan.pose is not None and len(plan.candidates) >= 400
    assert "gets no certified grasp: no grasp lifts it; planned by the networks" in capsys.readouterr().err
    assert plan.seconds["pose"] > 0 and plan.seconds["total"] > sum(
        plan.seconds[stage] for stage in ("pose", "score", "select")
    )
    network = planner.plan(frame, np.random.default_rng(0))
    assert np.array_equal(plan.grasp.as_vector(), network.grasp.as_vector())
    # The same where no pose has a grasp, but not where the networks are asked for (`assess` does).
    none = dataclasses.replace(others, grasps=())
    CertifiedPlanner(planner, PART, none).plan(frame, np.random.default_rng(0))
    assert "gets no certified grasp: no grasp lifts it; planned by the networks" in capsys.readouterr().err
    asked_for = CertifiedPlanner(planner, PART, dataclasses.replace(none, without={}))
    asked_for.plan(frame, np.random.default_rng(0))
    assert "certified" not in capsys.readouterr().err


def test_where_the_part_always_tilts_it_is_planned_with_the_tilt(cell, planner, capsys):
    frame, true = present(cell, 2)
    resting = resting_of(true)
    (poor, sure), reason = grasps(resting).grasps, "it tilts by more than 2 degrees"
    tilts = dataclasses.replace(sure, swing=np.array([0.2, 0.0]))
    known = dataclasses.replace(
        grasps(resting), grasps=(), uncertified=(poor, tilts), without={resting: reason}
    )
    plan = CertifiedPlanner(planner, PART, known).plan(frame, np.random.default_rng(0))
    assert plan.planned_by == "uncertified" and np.linalg.norm(plan.swing) == pytest.approx(0.2)
    assert f"{reason}; planned with the best that was simulated" in capsys.readouterr().err
    assert "2 simulated grasps, none certified" in plan_text(plan)
    CertifiedPlanner(planner, PART, known, lambda grasp: False).plan(frame, np.random.default_rng(0))
    assert f"{reason}, and the arm reaches none of these; planned by the networks" in capsys.readouterr().err
    # A certified grasp of the pose comes first.
    both = dataclasses.replace(known, grasps=(sure,), without={})
    assert CertifiedPlanner(planner, PART, both).plan(frame, np.random.default_rng(0)).certified


def test_where_an_image_fits_two_poses_the_networks_plan(cell, planner, capsys):
    box = find_part("enclosure_85x56x40")
    cell.feeder.present(box.name, 0)  # on its side, the opening hidden from the camera
    own = CertifiedPlanner(planner, box, grasps(2, box))
    plan = own.plan(cell.camera.capture(), np.random.default_rng(0))
    assert plan.pose is not None and plan.pose.resting in (2, 3) and not plan.certified
    assert "the image fits two poses of it; planned by the networks" in capsys.readouterr().err


@pytest.mark.slow
def test_in_a_pose_that_topples_in_the_simulation_the_networks_plan(cell, planner, capsys):
    frame, true = present(cell, 2)
    resting = resting_of(true)
    stands = tuple(number != resting for number in range(len(PART.resting_probability)))
    others = grasps((resting + 1) % len(stands))
    toppling = dataclasses.replace(others, stands=stands, without={resting: "it topples in the simulation"})
    plan = CertifiedPlanner(planner, PART, toppling).plan(frame, np.random.default_rng(0))
    assert plan.pose is not None and plan.pose.resting == resting and not plan.certified
    assert "it topples in the simulation; planned by the networks" in capsys.readouterr().err


def test_another_part_is_refused(cell, planner):
    cell.feeder.present("hex_nut_m20", 0)
    own = CertifiedPlanner(planner, PART, grasps(0))
    with pytest.raises(PartNotRecognised, match="this is not l_bracket_60x40"):
        own.plan(cell.camera.capture(), np.random.default_rng(0))


def test_a_part_without_a_file_is_planned_by_the_networks(cell, planner, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("mskgrasp.planning.certified.parts_folder", lambda: tmp_path / "parts")
    assert planner_of_part(planner, cell, PART) is planner
    assert "planned by the networks: no certified grasps of 'l_bracket_60x40'" in capsys.readouterr().err
