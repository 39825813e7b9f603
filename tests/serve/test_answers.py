"""Answers of the planner to requests."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from mskgrasp.core.grasp import lowest_grasp_z
from mskgrasp.planning.planner import PROMISING, Planner
from mskgrasp.serve.answers import place_answer, respond
from mskgrasp.serve.requests import MAX_ALTERNATIVES, PlaceRequest, PlanRequest, body_schema
from tests import synthetic
from tests.planning.workspaces import WORKSPACE
from tests.serve.bodies import ALONG, FRAME, JSON, NPZ, npz, text


def answer(planner: Planner, kind: str, body: bytes, content_type: str = NPZ):
    status, found = respond(planner, kind, content_type, body)
    return status, json.loads(found)


def test_a_plan_is_that_of_the_planner_with_alternatives_in_its_order(planner: Planner):
    status, found = answer(planner, "plan", npz(seed=5, alternatives=4))
    plan = planner.plan(FRAME, np.random.default_rng(5))
    assert status == 200 and found["quality"] > 0.9
    np.testing.assert_allclose(found["grasp"], plan.grasp.as_vector(), atol=1e-6)
    np.testing.assert_allclose(found["displacement_cov"], plan.displacement_cov, atol=1e-9)
    scores = [one["score"] for one in found["alternatives"]]
    assert len(scores) == 4 and scores == sorted(scores) and scores[0] >= found["score"]
    assert all(one["quality"] >= 0.5 and one["grasp"] != found["grasp"] for one in found["alternatives"])


def test_alternatives_below_the_sure_quality_come_last_by_quality(planner: Planner):
    bound = float(np.sort(planner.plan(FRAME, np.random.default_rng(0)).qualities)[-4])
    half_sure = copy.copy(planner)
    half_sure.config = planner.config.model_copy(update={"sure_quality": bound})
    _, found = answer(half_sure, "plan", npz(alternatives=MAX_ALTERNATIVES))
    pairs = [(one["quality"], one["score"]) for one in found["alternatives"]]
    sure = [one for one in pairs if one[0] >= bound]
    assert 0 < len(sure) < len(pairs)
    assert pairs == [*sorted(sure, key=lambda one: one[1]), *sorted(pairs[len(sure) :], reverse=True)]


def test_no_more_alternatives_are_listed_than_the_last_selection_has_and_the_schema_says_so(planner: Planner):
    _, found = answer(planner, "plan", npz(alternatives=MAX_ALTERNATIVES))
    assert 4 < len(found["alternatives"]) <= found["n_shortlist"] - 1 == PROMISING - 1 < MAX_ALTERNATIVES
    schema = body_schema(PlanRequest)["requestBody"]["content"][JSON]["schema"]
    assert "never more than n_shortlist - 1" in schema["properties"]["alternatives"]["description"]


def test_a_pose_of_the_hand_belongs_to_the_grasp(planner: Planner):
    _, found = answer(planner, "plan", npz(alternatives=0))
    x, y, z, qw, qx, qy, qz = found["T_base_tcp"]
    assert [x, y, z] == found["grasp"][:3] and found["alternatives"] == []
    # Rz(theta) Rx(pi): z down, turned by theta.
    half = found["grasp"][3] / 2
    np.testing.assert_allclose([qw, qx, qy, qz], [0, np.cos(half), np.sin(half), 0], atol=1e-12)


def test_a_grasp_across_the_box_scores_high_and_one_beside_it_low(planner: Planner):
    beside = [ALONG[0] + 0.06, ALONG[1] + 0.06, *ALONG[2:]]
    status, found = answer(planner, "score", npz(grasps=[ALONG, beside]))
    assert status == 200 and [one["grasp"] for one in found["grasps"]] == [ALONG, beside]
    across, missing = (one["quality"] for one in found["grasps"])
    assert across > 0.9 and missing < 0.3
    covariance = np.array(found["grasps"][0]["displacement_cov"])
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9)
    assert (np.linalg.eigvalsh(covariance) > 0).all()


def test_the_planned_grasp_scores_as_it_was_planned_in_either_form(planner: Planner):
    _, plan = answer(planner, "plan", text(seed=1), JSON)
    _, scored = answer(planner, "score", text(grasps=[plan["grasp"]]), JSON)
    for name in ("quality", "displacement", "displacement_cov", "score"):
        np.testing.assert_allclose(scored["grasps"][0][name], plan[name], rtol=1e-3, atol=1e-7)


@pytest.mark.parametrize(
    ("boxes", "message"),
    [
        ([], "nothing rises more than 2 mm"),
        ([synthetic.Box(x=0.47, y=0.0, yaw=0.0, size=(0.12, 0.12, 0.05))], "wider than the hand opens"),
        ([synthetic.Box(x=x, y=0.0, yaw=0.0, size=(0.03, 0.03, 0.03)) for x in (0.42, 0.53)], "two things"),
    ],
    ids=("nothing", "wide", "two"),
)
def test_where_nothing_can_be_planned_the_answer_is_422_with_the_reason(
    planner: Planner, boxes, message: str
):
    status, found = answer(planner, "plan", npz(depth=synthetic.render(boxes)))
    assert status == 422 and message in found["error"]


def test_a_part_held_at_its_centre_is_placed_with_its_centre_at_the_target():
    request = PlaceRequest(
        grasp=(0.5, 0.1, 0.03, 0.2),
        displacement=(0.0, 0.004, 0.0, 0.0),
        centre_base=(0.5, 0.1, 0.02),
        target={"x": 0.4, "y": -0.1, "theta": -0.2},  # pyright: ignore[reportArgumentType]
    )
    x, y, z, theta = place_answer(request, WORKSPACE.lowest_grasp_z)["hand"]
    # The hand is turned to 0: the part has moved by 4 mm along its y, hence the hand stands 4 mm before.
    np.testing.assert_allclose([x, y, theta], [0.4, -0.104, 0.0], atol=1e-12)
    assert 0.03 <= z < 0.04 and z > lowest_grasp_z(0.0)


def test_a_defect_is_logged_and_answered_without_its_details(capsys):
    broken: Planner = None  # pyright: ignore[reportAssignmentType]
    status, found = answer(broken, "plan", npz())
    assert status == 500 and "defect of the server" in found["error"] and "NoneType" not in found["error"]
    assert "AttributeError" in capsys.readouterr().err
