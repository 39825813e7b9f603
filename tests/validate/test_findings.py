"""Findings name what was put into made-up outcomes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mskgrasp.validate.config import MOVED, NOMINAL, Margins, ValidateConfig, floor_name
from mskgrasp.validate.findings import (
    choose,
    compare_with_reference,
    label_error,
    sensitivity,
    size,
)
from mskgrasp.validate.outcomes import Outcomes
from tests.validate.made_up import PARTS, moved, outcomes

REFERENCE = "2000 Hz, 100 it"


def found(per_part: int = 40, **settings: Outcomes) -> dict[str, Outcomes]:
    reference = outcomes(per_part)
    noise = np.random.default_rng(1).normal(0, 5e-5, reference.displacement.shape)
    return {REFERENCE: reference, floor_name(REFERENCE): moved(reference, noise), **settings}


def judged(one: Outcomes, name: str = "coarse", cpu_ms: float = 100.0):
    result = compare_with_reference(found(**{name: one}), name, REFERENCE, 40, Margins())
    return dataclasses.replace(result, found=dataclasses.replace(result.found, cpu_ms=cpu_ms))


def test_the_cheapest_equivalent_setting_is_chosen():
    same = outcomes(40)
    near, far = moved(same, [1e-4, 0, 0, 0]), moved(same, [1e-3, 0, 0, 0])
    settings = [judged(near, "dear", 90), judged(near, "cheap", 40), judged(far, "wrong", 10)]
    sizes = {"dear": (1000, 50), "cheap": (500, 50), "wrong": (250, 15)}
    assert choose(settings, sizes) == ("cheap", True)
    assert choose(settings, sizes | {"wrong": (500, 100)}) == ("dear", True)  # finer than the cheap one
    [said] = settings[2].complaints()
    assert said.startswith("median displacement beyond the floor: +0.9") and "the margin of 0.25" in said
    assert settings[2].displacement.estimate == pytest.approx(1e-3 - 8e-5, abs=3e-5)


def test_where_nothing_passes_the_choice_is_by_cost_among_the_likely():
    same = outcomes(40)
    lost = same.success.copy()
    lost[:: len(lost) // 12] = ~lost[:: len(lost) // 12]  # 1.5 % differ: likely the same, but not shown
    likely = dataclasses.replace(
        same, success=lost, displacement=np.where(lost[:, None], same.displacement, np.nan)
    )
    far = moved(same, [1e-3, 0, 0, 0])
    one = compare_with_reference(found(likely=likely), "likely", REFERENCE, 8, Margins())
    assert not one.passed and "success rate" in one.complaints()[0]
    assert choose([judged(far, "wrong", 10), one], {"wrong": (250, 15), "likely": (500, 50)}) == (
        "likely",
        False,
    )
    assert choose([judged(far, "wrong", 10)], {"wrong": (250, 15)}) == ("wrong", False)


def test_a_constant_bias_cannot_hide_behind_the_floor():
    """A shift of every grasp raises the median distance, however much the grasps scatter one by one."""
    same = outcomes(40)
    for axis in range(3):
        shift = np.zeros(4)
        shift[axis] = 4e-4
        assert not judged(moved(same, shift)).passed


def test_variants_are_compared_with_production_on_the_same_grasps():
    config = ValidateConfig(
        grasps_per_part=10, variant_grasps_per_part=4, variants={"hulls": {"exact": {"hulls": "exact"}}},
        ranges={"finger_force": (20.0, 40.0)},
    )  # fmt: skip
    nominal = outcomes(10)
    changed = moved(nominal.of(["part-03", "part-07"], 4), [2e-3, 0, 0, 0])
    drawn = moved(nominal.of(sorted(set(nominal.part)), 4), [0, 1e-3, 0, 0.1])
    settings = {NOMINAL: nominal, MOVED: nominal, "hulls: exact": changed, "all drawn together": drawn}
    start, exact = sensitivity(config, settings)
    assert (start.group, start.found.n, start.found.shift_p90) == ("start", 4 * PARTS, 0)
    assert (exact.parts, exact.found.n) == (2, 8)
    assert exact.found.shift_median == pytest.approx(2e-3)
    result = label_error(config, settings)
    assert result is not None and result.found.shift_median == pytest.approx(1e-3)
    assert result.found.turn_p90 == pytest.approx(0.1)
    stored = result.to_json()
    assert stored["shift_median"] == result.found.shift_median
    assert stored["ranges"] == {"finger_force": [20.0, 40.0]}
    own = np.linalg.norm(nominal.displacement[nominal.success, :3], axis=1)
    assert size(nominal).shift_median == pytest.approx(np.median(own))


def test_without_successes_in_common_nothing_can_be_said():
    n = len(outcomes(40).success)
    nothing = outcomes(40, success=np.zeros(n, bool), displacement=np.full((n, 4), np.nan))
    result = judged(nothing)
    assert result.complaints()[0] == (
        "median displacement beyond the floor: not shown by fewer than 10 parts (here 0)"
    )
    assert result.to_json()["shift_median"] is None and not result.passed
    assert size(nothing).to_json()["shift_median"] is None
