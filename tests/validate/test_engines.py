"""SAPIEN and MuJoCo on the same grasps."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.validate.__main__ import main
from mskgrasp.validate.compare import compare_outcomes
from mskgrasp.validate.config import SHIFTED
from mskgrasp.validate.engines import complaints, disagreements, intervals, lasting_disagreements, tilted
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
    first = [said.split()[0] for said in complaints(compare_outcomes(other, one))]
    assert first == ["success", "displacements"]
    assert sorted(disagreements(other, one)) == [(("held", "missed"), 10), (("slipped", "held"), 10)]


def test_disagreements_that_last_are_those_that_no_moved_start_changes():
    sapien = outcomes()
    differing = np.flatnonzero(sapien.settled)[:6]
    success = sapien.success.copy()
    success[differing] = ~success[differing]
    mujoco = dataclasses.replace(sapien, success=success)
    moved = success.copy()
    moved[differing[:2]] = ~moved[differing[:2]]
    found = {
        "sapien": sapien,
        f"sapien{SHIFTED}": sapien,
        "mujoco": mujoco,
        f"mujoco{SHIFTED}": dataclasses.replace(sapien, success=moved),
    }
    assert lasting_disagreements(found) == 4


def test_intervals_hold_the_figures_and_widen_where_parts_differ():
    sapien = outcomes()
    displacement = sapien.displacement.copy()
    names = np.unique(sapien.part)
    for k, name in enumerate(names):
        displacement[sapien.part == name, 0] += 1e-3 * k
    mujoco = dataclasses.replace(sapien, displacement=displacement)
    found = intervals(mujoco, sapien)
    assert found["agreement"] == (1.0, 1.0)
    low, high = found["shift_median"]
    assert 0 <= low < 0.5e-3 * (len(names) - 1) < high <= 1e-3 * (len(names) - 1)


def test_tilts_are_counted_by_the_engine_that_has_them():
    one = outcomes()
    held = np.flatnonzero(one.success)
    tilts = np.full((2, len(one.tilt)), 0.01)
    tilts[0, held[:5]] = 0.1
    tilts[1, held[3:9]] = 0.1
    mujoco, sapien = (dataclasses.replace(one, tilt=tilt) for tilt in tilts)
    assert tilted(mujoco, sapien) == dict(n=len(held), mujoco=3, both=2, sapien=4)


@pytest.mark.slow
def test_both_engines_try_the_same_grasps(tmp_path: Path):
    done = run_here(
        main, "--engine", "mujoco", "--parts", "hex_nut_m30", "--grasps-per-part", "3", "--workers", "1",
        "--out", str(tmp_path),
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    record = json.loads((tmp_path / "engines.json").read_text())
    found = record["engines"]
    assert found["hex_nut_m30"] == found["all"] and found["all"]["n"] == 3
    assert found["all"]["agreement"] >= 0.6 and found[f"mujoco{SHIFTED}"]["shift_median"] < 1e-3
    assert "mujoco" in record["versions"]
    assert set(record["intervals"].values()) == {None}  # of one part
    assert "(of 3 grasps); displacements of" in done.stdout and "nan .. nan" not in done.stdout
