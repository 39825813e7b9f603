"""Settings of planning one grasp."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.plan.config import PlanConfig
from mskgrasp.runtime.options import parse


def read(*arguments: str) -> PlanConfig:
    return parse(PlanConfig, prog="plan", description="", argv=arguments)


def test_without_options_the_shipped_model_plans_in_the_simulated_cell():
    config = read()
    assert (config.models / "model.safetensors").is_file() and config.cell.is_file() and config.part is None


def test_options_set_the_planner_and_the_part():
    config = read(
        "--part", "a.stl", "--unit", "in", "--planner.policy", "quality", "--planner.n-candidates", "9"
    )
    assert (config.part, config.unit, config.planner.policy, config.planner.n_candidates) == (
        "a.stl", "in", "quality", 9,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--unit", "furlong"), "--unit: 'furlong' is not legal; legal: .*mm"),
        (("--seed", "-1"), "--seed: input should be greater than or equal to 0, got -1"),
        (("--planner.top-fraction", "0"), "--planner.top-fraction: input should be greater than 0"),
        (("--planner.policy", "best"), "legal: low_variance, quality"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(arguments: tuple[str, ...], message: str):
    with pytest.raises(UsageError, match=message) as raised:
        read(*arguments)
    assert "\n" not in str(raised.value)
