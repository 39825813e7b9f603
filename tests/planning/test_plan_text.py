"""A plan in words."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from mskgrasp.planning.plan_text import plan_text, verdict
from tests.planning.hand_made import FRAME, planner


def test_a_plan_is_described_in_millimetres_and_degrees():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    text = plan_text(plan)
    lines = dict(line.split("  ", 1) for line in text.splitlines())
    x, y, z, theta = (float(value) for value in re.findall(r"-?\d+\.\d+", lines["grasp"]))
    np.testing.assert_allclose([x, y, z], plan.grasp.position, atol=5e-5)
    assert theta == pytest.approx(np.degrees(plan.grasp.theta), abs=0.05)
    # The hand-made network moves the hand by 1 and 2 mm and turns it by 0.1 rad: the part, the other way.
    assert "dtheta -5.7 +- " in lines["displacement"]
    assert f"dx {1e3 * plan.displacement[0]:+.1f} +- {1e3 * plan.displacement_std[0]:.1f} mm" in text
    assert (
        len(plan.candidates) > 600
        and f"best of {len(plan.candidates)}" in lines["quality"]
        and "sample" in lines["planned in"]
        and "total" not in text
    )


def test_a_plan_says_whether_it_is_worth_trying():
    assert verdict(0.5) == "worth trying: the part is lifted with a predicted probability of 50%"
    assert verdict(0.31, 0.4).startswith("not worth trying: ") and "31%, under 50%" in verdict(0.31)
    assert verdict(0.31, 0.4).endswith("; place it another way")
    assert verdict(0.01, 0.695).endswith("; others reach 70%, which --planner.min-quality 0.5 takes")
    plan = planner().plan(FRAME, np.random.default_rng(0))
    assert f"verdict       {verdict(plan.quality)}" in plan_text(plan).splitlines()


def test_a_plan_says_how_far_the_part_may_miss_its_predicted_place():
    plan = dataclasses.replace(planner().plan(FRAME, np.random.default_rng(0)), score=0.0132**2)
    assert "expected 13.2 mm (RMS) from their predicted places, a tilt included" in plan_text(plan)
    assert "precision" not in plan_text(dataclasses.replace(plan, score=np.nan))


def test_without_a_predicted_variance_no_deviation_is_told():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    nothing = np.full(2, np.nan)
    known = dataclasses.replace(
        plan, grasp_displacement_cov=np.full((4, 4), np.nan), swing_var=nothing, score=np.nan
    )
    assert "nan" not in plan_text(known) and "dtheta -5.7 deg" in plan_text(known)


def test_a_planner_that_states_no_quality_gets_no_verdict():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    text = plan_text(dataclasses.replace(plan, quality=np.nan, planned_by="another planner"))
    assert "quality       none stated\n" in text and "verdict" not in text and "nan" not in text
