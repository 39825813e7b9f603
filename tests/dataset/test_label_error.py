"""The error of a label that a dataset's card states."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.settings import Physics
from mskgrasp.dataset import read_shard, shard_path, write_shard
from mskgrasp.dataset.card import read_card, tables
from mskgrasp.dataset.label_error import STORED, LabelError, read_label_error
from mskgrasp.simulation.versions import SIMULATION_VERSION
from tests import synthetic

MADE_UP = LabelError(
    simulation="7",
    n=120,
    agreement=0.95,
    shift_median=0.0005,
    shift_p90=0.0031,
    turn_median=np.radians(0.25),
    turn_p90=np.radians(4.0),
)


def test_what_is_stored_is_of_the_simulation_that_collects():
    stored = LabelError(**json.loads(STORED.read_text()))
    assert stored.simulation == str(SIMULATION_VERSION)
    assert stored.n >= 100 and 0.5 < stored.agreement <= 1
    assert 0 < stored.shift_median < stored.shift_p90 < 0.05
    assert 0 < stored.turn_median < stored.turn_p90 < np.pi


@pytest.mark.parametrize(
    ("made_by", "words"),
    [
        (["7"], "median 0.50 mm, 0.25 degrees; 90 % under 3.1 mm, 4.0 degrees; success agrees in 95.0% (120"),
        (["6"], "not known: made by simulation version 6, measured for 7"),
        (["6", "7"], "not known: made by simulation version 6, 7, measured for 7"),
        ([], "not known: made by simulation version unknown, measured for 7"),
    ],
)
def test_it_is_stated_only_for_the_simulation_it_was_measured_with(
    made_by: list[str], words: str, tmp_path: Path
):
    path = tmp_path / "label_error.json"
    path.write_text(json.dumps(asdict(MADE_UP)))
    physics = Physics().model_dump()
    assert read_label_error(made_by, physics, path).startswith(words)
    other = physics | {"position_iterations": 4, "finger_force": 70.0}
    if words.startswith("median"):
        words = (
            "not known: measured for production's settings, of which position_iterations, finger_force differ"
        )
    assert read_label_error(made_by, other, path).startswith(words)


def test_the_card_states_it_for_data_of_the_simulation_it_was_measured_with(tmp_path: Path):
    measured = json.loads(STORED.read_text())
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=1, n_attempts=5, seed=2)
    path = shard_path(folder, "box_0", 0)
    attempts, info = read_shard(path)

    def stated() -> str:
        return dict(tables(read_card(folder))[0][2])["error of a label"]

    assert stated() == (
        f"not known: made by simulation version unknown, measured for {measured['simulation']}"
    )
    write_shard(path, attempts, replace(info, versions={"simulation": measured["simulation"]}))
    assert stated().startswith(f"median {1e3 * measured['shift_median']:.2f} mm, ")
    assert f"success agrees in {measured['agreement']:.1%} ({measured['n']}" in stated()
