"""Summaries of trials, against numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from mskgrasp.evaluate.comparison import compare_models
from mskgrasp.evaluate.figures import draw_comparison, draw_displacements, draw_success
from mskgrasp.evaluate.summary import largest_errors, summarise_trials, worst_trials
from tests.evaluate.made_trials import NOTHING, Model, printed, report_of, trial


def test_success_and_errors_follow_their_definitions():
    summary = summarise_trials([trial(), trial(number=1, success=False, reason="missed", measured=None)])
    overall = summary.overall
    assert overall.trials == 2 and overall.successes == 1 and overall.success_rate == 0.5
    assert overall.translation_rmse == pytest.approx(0.005)
    assert overall.rotation_rmse == pytest.approx(0.2)
    assert overall.translation_rmse_of_zero == pytest.approx(0.004)
    assert overall.translation_interval is None  # a single part has no spread over parts
    assert summary.families["nut"].reasons == {"missed": 1}


def test_intervals_are_over_parts_not_over_grasps():
    """Three parts, one with twice the error: a hundred and fifty grasps tell no more than three would."""
    far = [trial(part="b", number=k, measured=[-0.003, 0.008, 0.0, 0.1]) for k in range(50)]
    near, alike = (
        [trial(part=part, number=k, measured=[0.0, 0.004, 0.0, 0.1]) for k in range(50)] for part in "cd"
    )
    interval = summarise_trials(far + near + alike).overall.translation_interval
    # Mean squares without one part, square millimetres; Student's t of two degrees of freedom, 4.3027.
    logs = np.log([25.0, 62.5, 62.5]) / 2
    factor = np.exp(4.3027 * np.sqrt(2 / 3 * ((logs - logs.mean()) ** 2).sum()))
    rmse = np.sqrt((2 * 0.005**2 + 0.010**2) / 3)
    assert interval == pytest.approx((rmse / factor, rmse * factor), rel=1e-3)
    assert summarise_trials(far + near).overall.translation_interval is None


def test_the_interval_of_the_success_rate_is_over_parts_too():
    """Half of the parts is never lifted: fifty trials of them tell as much as ten parts do."""
    trials = [
        trial(part=f"part {k}", number=n, family="nut" if k < 5 else "bolt", success=k < 5, measured=None)
        for k in range(10)
        for n in range(5)
    ]
    summary = summarise_trials(trials)
    overall = summary.overall
    assert overall.success_interval is not None
    assert overall.success_interval[0] < 0.24 and overall.success_interval[1] > 0.76
    # Of a family all parts are alike: they tell as much as five trials, or as 25, or anything between.
    low, high = summary.families["bolt"].success_interval or (1.0, 0.0)
    assert low == 0.0 and beta.ppf(0.975, 0.5, 25.5) < high < beta.ppf(0.975, 0.5, 5.5)


def test_shares_within_an_error_are_of_all_attempts_and_parts_that_hang_tilted_are_reported_apart():
    precise = [trial(number=k, predicted=[0.0, 0.004 + 1e-3 * k, 0.0, -0.1]) for k in range(4)]
    tilted = trial(part="b", predicted=[0.0, 0.014, 0.0, -0.1], tilt=0.05)
    lost = trial(part="c", success=False, reason="slipped", measured=None, tilt=None)
    found = summarise_trials([*precise, tilted, lost]).overall
    assert found.within is not None and found.tilted is not None
    assert [(one.n, one.of) for one in found.within] == [(2, 6), (3, 6)]
    assert (found.tilted.n, found.tilted.of, found.flat) == (1, 5, 4)
    assert found.flat_translation_rmse == pytest.approx(1e-3 * np.sqrt(14 / 4))
    assert found.translation_rmse == pytest.approx(1e-3 * np.sqrt(114 / 5))
    assert "50.0% [" in printed(summarise_trials([*precise, tilted, lost]))


def test_what_was_not_measured_is_not_counted_as_off_and_a_tilt_that_is_not_known_not_as_flat():
    exact = dict(predicted=[0.0, 0.004, 0.0, -0.1], tilt=None)
    unmeasured = [trial(number=k, measured=None, unmeasured="one found: 1 of 2", tilt=None) for k in (2, 3)]
    trials = [*(trial(number=k, **exact) for k in (0, 1)), *unmeasured, trial(number=4, **NOTHING, tilt=None)]
    found = summarise_trials(trials).overall
    assert found.within is not None
    assert [(one.n, one.of) for one in found.within] == [(2, 3), (2, 3)]
    assert (found.flat, found.flat_translation_rmse, found.tilted) == (0, None, None)


def test_grasps_of_the_networks_are_told_from_certified_ones():
    by = ("networks", "certified", "certified", "uncertified")
    own = [trial(number=k, policy="certified", planned_by=one) for k, one in enumerate(by)]
    refused = trial(number=4, policy="certified", **NOTHING)
    found = summarise_trials([*own[:3], refused])
    assert found.overall.certified == (2, 3) and found.overall.uncertified == 0
    assert "2 of 3 planned grasps are certified; the others are the networks'" in printed(found)
    all_kinds = printed(summarise_trials(own))
    assert "2 of 4 planned grasps are certified, 1 simulated but not certified; the others" in all_kinds
    assert "2 of 2 planned grasps are certified\n" in printed(summarise_trials(own[1:3]))
    assert summarise_trials([trial(planned_by="networks")]).overall.certified is None  # another policy
    compared = compare_models([replace(one, chosen_by="certified") for one in own], {})
    assert "certified grasps: 2 of 4 planned grasps are certified" in printed(compared)


def test_without_a_success_errors_are_absent_not_zero(tmp_path: Path):
    trials = [trial(**NOTHING)]
    summary = summarise_trials(trials)
    assert summary.overall.translation_rmse is None and summary.overall.median_planning_s is None
    assert summary.overall.reasons == {"no part found": 1}
    assert "0 of 1" in printed(summary) and " - " in printed(summary) and "nan" not in printed(summary)
    draw_success(summary, tmp_path / "success.png")
    draw_displacements(trials, tmp_path / "errors.png")
    compared = compare_models(trials, {"one": Model()})
    assert compared.models["one"].quality.known.translation_rmse is None
    assert "nan" not in printed(compared)
    draw_comparison(compared, tmp_path / "displacement.png")
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_an_unmeasured_success_is_counted_and_has_no_error():
    unmeasured = trial(number=1, measured=None, unmeasured="one found: the larger square is seen, ...")
    planar = trial(measured=[0.0, 0.004, np.nan, -0.1], true=[0.0, 0.0043, 0.001, -0.1])
    summary = summarise_trials([planar, unmeasured])
    assert summary.overall.unmeasured == {"one found": 1}
    assert summary.overall.measured == 1 and summary.overall.successes == 2
    assert summary.overall.translation_rmse == pytest.approx(0.005)
    assert summary.tape_against_truth is not None
    assert summary.tape_against_truth.flat.translation_rmse == pytest.approx(0.0003)
    assert "1 of 2 lifted not measured: one found 1" in printed(summary)
    assert report_of(summary).to_json()["tape_against_truth"]["tilted"] == {"trials": 0}


def test_tape_errors_of_tilted_parts_are_reported_apart():
    flat = trial(measured=[0.0, 0.004, np.nan, 0.0], true=[0.0, 0.004, 0.0, 0.0])
    tilted = trial(number=1, measured=[0.0, 0.004, np.nan, 0.0], true=[0.006, 0.004, 0.0, 0.0], tilt=0.2)
    found = summarise_trials([flat, tilted]).tape_against_truth
    assert found is not None and found.flat.trials == found.tilted.trials == 1
    assert found.flat.translation_worst == 0.0
    assert found.tilted.translation_worst == pytest.approx(0.006)


def test_the_worst_are_confident_failures_then_the_largest_errors():
    confident = trial(number=1, success=False, reason="missed", measured=None, quality=0.99)
    doubtful = trial(number=2, success=False, reason="missed", measured=None, quality=0.1)
    turned = trial(number=3, measured=[0.003, 0.0, 0.0, 1.1])
    trials = [trial(), doubtful, turned, confident]
    assert [one.number for one in worst_trials(trials)] == [1, 2, 3, 0]
    assert [one.number for one in largest_errors(trials, 1)] == [3]
