"""Recording devices pass on what they are asked."""

from __future__ import annotations

import json
from pathlib import Path

from hal.replay import recorded_cell
from tests.hal.replay.program import run_on
from tests.hal.replay.toy import ToyArm, toy_cell


def test_a_recorded_cell_does_what_the_cell_does(tmp_path: Path):
    bare, kept = toy_cell(), toy_cell()
    logs: list[list[object]] = [[], []]
    with bare.connected():
        run_on(bare, logs[0])
    with recorded_cell(kept, tmp_path / "run.h5").connected() as cell:
        run_on(cell, logs[1])
    assert json.dumps(logs[0]) == json.dumps(logs[1])
    assert isinstance(bare.arm, ToyArm) and isinstance(kept.arm, ToyArm)
    assert bare.arm.moves == kept.arm.moves
