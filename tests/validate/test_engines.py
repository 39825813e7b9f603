"""SAPIEN and MuJoCo on the same grasps."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np

from mskgrasp.validate.__main__ import main
from mskgrasp.validate.compare import compare_outcomes
from mskgrasp.validate.config import SHIFTED
from mskgrasp.validate.engines import complaints, disagreements
from tests.programs import run_here
from tests.validate.made_up import outcomes


def test_engines_that_differ_are_reported_with_the_kinds_of_disagreement():
    one = outcomes()
    one = dataclasses.replace(one, failure=np.where(one.success, 0, 1))
    assert complaints(compare_outcomes(one, one)) == []
    success = one.success.copy()
    success[:20] = ~success[:20]
    moved = np.where(success[:, None], np.nan_to_num(one.displacement) + 0.001, np.nan)
    other = dataclasses.replace(one, success=success, displacement=moved, failure=np.where(success, 0, 2))
    assert [said.split()[0] for said in complaints(compare_outcomes(other, one))] == ["S", "displacements"]
    assert sorted(disagreements(other, one)) == [(("held", "missed"), 10), (("slipped", "held"), 10)]


def test_both_engines_try_the_same_grasps(tmp_path: Path):
    done = run_here(
        main, "--engine", "mujoco", "--parts", "hex_nut_m30", "--grasps-per-part", "6", "--workers", "1",
        "--out", str(tmp_path),
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    record = json.loads((tmp_path / "engines.json").read_text())
    found = record["engines"]
    assert found["hex_nut_m30"] == found["all"] and found["all"]["n"] == 6
    assert found["all"]["agreement"] >= 0.6 and found[f"mujoco{SHIFTED}"]["shift_median"] < 1e-3
    assert "mujoco" in record["versions"]
