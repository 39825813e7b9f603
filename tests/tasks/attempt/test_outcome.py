from __future__ import annotations

import dataclasses

import pytest
import torch

from mskgrasp.core.grasp import FAILURES
from tasks.attempt.outcome import Observed, judge

HELD = Observed(
    settled=torch.tensor([True]),
    collided=torch.tensor([False]),
    held_closed=torch.tensor([True]),
    pads_touch=torch.tensor([True]),
    gap=torch.tensor([0.02]),
    rise=torch.tensor([1.0]),
    relative_speed=torch.tensor([0.001]),
    penetration=torch.tensor([1e-5]),
    wandered=torch.tensor([0.01]),
)


def verdict(**changes: object) -> tuple[bool, str]:
    seen = dataclasses.replace(HELD, **{name: torch.tensor([value]) for name, value in changes.items()})
    success, failure = judge(seen)
    return bool(success[0]), FAILURES[int(failure[0])]


def test_a_held_lifted_part_is_a_success():
    assert verdict() == (True, "none")


def test_unknown_penetration_is_no_evidence_against_a_grasp():
    assert verdict(penetration=float("nan")) == (True, "none")


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (dict(collided=True), "collided"),
        (dict(settled=False), "unsettled"),
        (dict(held_closed=False), "missed"),
        (dict(pads_touch=False), "slipped"),
        (dict(gap=0.0004), "slipped"),
        (dict(rise=0.79), "slipped"),
        (dict(relative_speed=0.06), "slipped"),
        (dict(penetration=0.0011), "slipped"),
        (dict(rise=0.0, wandered=0.06), "ejected"),
        # Height alone is no success: a part that flies up without touching the pads.
        (dict(rise=1.2, pads_touch=False, wandered=0.08), "ejected"),
    ],
)
def test_each_condition_of_success_fails_for_its_own_reason(changes, reason):
    assert verdict(**changes) == (False, reason)
