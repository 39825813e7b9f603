"""A trial's record: what was planned, what happened, and how the hand is freed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hal.operator import Operator
from mskgrasp.core.grasp import MAX_OPENING
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.trials.engine import PlannedGrasp, TrialEngine
from mskgrasp.trials.measurement import finish, run_trial, safe_opening
from tests.planning.hand_made import FRAME, planner
from tests.trials.box_grasps import BoxCell


def test_a_measured_trial_compares_prediction_and_motion_of_the_parts_origin(box_cell: BoxCell):
    planned = box_cell.present(along=0.01, across=0.004)
    record = run_trial(box_cell.engine, planned, part="box", number=3, seed=box_cell.seed)
    trial, plan = record.trial, planned.plan
    assert plan is not None and record.plan is plan and record.frame is planned.frame
    assert (trial.key, trial.success, trial.reason, trial.unmeasured) == ("box-003", True, "", "")
    assert trial.measured is not None and trial.pose_base_obj is not None
    np.testing.assert_allclose(trial.measured[:3], [0, 0.004, 0], atol=8e-4)
    assert trial.point_base == trial.pose_base_obj[:3]
    # The hand-made network moves the hand by (1, 2) mm and turns it by 0.1 rad in the part's frame: the part
    # turns by -0.1 about the hand, and its origin c moves along.
    c = np.linalg.inv(plan.grasp.T_base_grasp.as_matrix())[:2] @ np.array([*trial.point_base, 1.0])
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    np.testing.assert_allclose(trial.predicted[:2], turn @ (c - [0.001, 0.002]) - c, atol=1e-6)
    assert trial.predicted[3] == pytest.approx(-0.1)
    assert record.in_hand and not record.aborted and record.after is None
    finish(box_cell.engine, record)


def test_without_a_tracker_a_success_is_counted_and_not_measured(box_cell: BoxCell):
    planned = box_cell.present()
    cell = dataclasses.replace(box_cell.engine.cell, tracker=None)
    engine = TrialEngine(cell, Operator(cell, yes=True))
    trial = run_trial(engine, planned, part="box", number=0, seed=0).trial
    assert trial.success and trial.measured is None and trial.pose_base_obj is None
    assert trial.unmeasured.startswith("no tracker: measure by tape")
    assert planned.plan is not None
    np.testing.assert_array_equal(trial.point_base, planned.plan.view.centre_base)
    # What the fingers feel is all that is known of a grasp over the part.
    over = run_trial(engine, box_cell.present(up=0.06), part="box", number=1, seed=0).trial
    assert (over.success, over.reason, over.measured) == (False, "missed", None)


def test_after_a_contact_the_arm_is_recovered(box_cell: BoxCell):
    record = run_trial(box_cell.engine, box_cell.present(across=0.045), part="box", number=0, seed=0)
    assert (record.trial.success, record.trial.reason) == (False, "collided")
    assert record.aborted and not record.in_hand and record.trial.measured is None
    finish(box_cell.engine, record)
    box_cell.engine.home()  # which an arm in error would refuse


def test_a_trial_without_a_plan_moves_nothing(box_cell: BoxCell):
    engine = box_cell.engine
    joints = engine.cell.arm.state().joints
    planned = PlannedGrasp(frame=FRAME, plan=None, reason="no part found")
    record = run_trial(engine, planned, part="box", number=0, seed=0)
    finish(engine, record)
    assert record.trial.reason == "no part found" and record.trial.grasp is None and record.plan is None
    np.testing.assert_array_equal(engine.cell.arm.state().joints, joints)


@pytest.mark.parametrize(
    ("aside", "deviation", "opening"),
    [
        (0.0, 0.0, MAX_OPENING),
        (0.002, 0.001, 0.072),  # 80 mm less twice 2 + 2 mm
        (-0.002, 0.001, 0.072),
        (0.002, np.nan, 0.076),  # a network without variances
        (0.03, 0.02, 0.0),
    ],
)
def test_the_hand_opens_as_far_as_the_displaced_part_leaves_room(aside, deviation, opening):
    plan = dataclasses.replace(
        planner(PlannerConfig(n_candidates=20)).plan(FRAME, np.random.default_rng(0)),
        grasp_displacement=np.array([0.0, -aside, 0.0, 0.0]),
        grasp_displacement_cov=np.diag([0.0, deviation**2, 0.0, 0.0]),
    )
    assert safe_opening(plan) == pytest.approx(opening, abs=1e-6)
