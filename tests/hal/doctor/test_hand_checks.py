"""Checks of a hand with a known fault."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hal import ArmState
from hal.doctor.hand_checks import check_grip, check_hand
from hal.hand import ConfiguredHand
from tests.hal.flat_table import WORKSPACE
from tests.hal.replay.toy import ToyArm


class HandArm(ToyArm):
    """Reports its hand."""

    def __init__(self, mass: float = 0.73, centre: tuple[float, ...] = (-0.01, 0.0, 0.03), **found: float):
        super().__init__()
        self.found, self.widest = found, found.pop("widest", 0.08)
        self.reported = ConfiguredHand(
            mass=mass, centre_flange=np.array(centre), load_mass=found.get("load_mass", 0.0)
        )

    def _hand(self) -> ConfiguredHand:
        return self.reported

    def _state(self) -> ArmState:
        return dataclasses.replace(super()._state(), max_width=self.widest)


@pytest.mark.parametrize(
    ("arm", "subject", "level", "words"),
    [
        (HandArm(), "hand", "ok", "Desk states 0.73 kg"),
        (HandArm(0.0, (0.0, 0.0, 0.0)), "hand", "fail", "choose it in Desk, Settings, End Effector"),
        (HandArm(0.88), "hand", "warn", "what changed fingers weigh"),
        (HandArm(0.73, (-0.01, 0.0, 0.09)), "hand", "warn", "0.73 kg at [-0.01, 0.0, 0.03] m"),
        (HandArm(load_mass=0.4), "load", "warn", "compensates 0.400 kg of an earlier program's part"),
        (HandArm(), "payload", "ok", "parts up to 2.27 kg"),
        (HandArm(widest=0.062), "fingers", "warn", "open to 62.0 mm, and grasps are planned for 80 mm"),
    ],
)
def test_the_hand_that_the_robot_is_configured_for_is_judged(
    arm: HandArm, subject: str, level: str, words: str
):
    with arm:
        findings = {finding.subject: finding for finding in check_hand(arm)}
    assert findings[subject].level == level and words in findings[subject].text
    assert {"hand", "payload"} <= set(findings) and all("\n" not in one.text for one in findings.values())


def test_an_arm_that_does_not_report_its_hand_is_not_judged():
    with ToyArm() as arm:
        assert list(check_hand(arm)) == []


@pytest.mark.parametrize(
    ("measured", "level", "words"),
    [
        (None, "warn", "not measured, simulation assumes its own; measure it: python -m hal.doctor"),
        (20.0, "ok", "21.5 N a pad at 25 mm/s a finger, measured for 20 N commanded"),
        (30.0, "warn", "workspace.grasp_force is 20 N: measure it"),
    ],
)
def test_a_grip_counts_for_the_force_that_it_was_measured_with(
    tmp_path: Path, measured: float | None, level: str, words: str
):
    grip = dict(grasp_force=measured, finger_force=21.5, finger_speed=0.025, max_width=0.08)
    table = {} if measured is None else dict(measured_grip=grip)
    values = dict(type="devices", arm=dict(driver="franky"), workspace=table)
    workspace = dataclasses.replace(WORKSPACE, grasp_force=20.0)
    finding = check_grip(values, tmp_path / "cell.yaml", workspace)
    assert finding is not None and finding.level == level and words in finding.text
    assert check_grip(dict(type="sapien"), tmp_path / "cell.yaml", workspace) is None
