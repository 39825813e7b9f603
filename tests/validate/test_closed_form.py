"""Experiments of closed-form physics."""

from __future__ import annotations

from mskgrasp.core.settings import Physics
from mskgrasp.validate.check import Check
from mskgrasp.validate.closed_form import run_checks


def test_a_coarse_simulation_fails():
    reported: list[Check] = []
    coarse = Physics(rate_hz=100, position_iterations=4)
    checks = run_checks(coarse, reported.append)
    failed = [check.name for check in checks if not check.passed]
    assert "fall in 0.2 s" in failed and len(failed) >= 3
    assert reported == checks
