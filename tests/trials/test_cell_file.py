"""Cell files with overrides of the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from hal.errors import LoadTooHeavy
from mskgrasp.core.errors import UsageError
from mskgrasp.trials.cell_file import check_loads, read_cell
from tests.boxes import make_box
from tests.hal.real_cell import measured_cell

WEIGHTS = (("light", 1.2), ("heavy", 1.4))
CELLS = Path(__file__).parents[2] / "configs" / "cells"


def test_noise_overrides_the_files_model_and_keeps_its_settings(tmp_path: Path):
    path = tmp_path / "cell.yaml"
    path.write_text("type: sapien\nnoise: {model: iid, seed: 3}\n")
    plain = read_cell(path, noise=None, measure="truth", tape=None)
    assert plain.noise == "iid" and plain.tape is None
    other = read_cell(path, noise="kinect2", measure="truth", tape=None)
    assert other.noise == "kinect2" and other.digest != plain.digest
    run = tmp_path / "run"
    run.mkdir()
    written = yaml.safe_load(other.write(run).read_text())
    assert written["noise"] == {"model": "kinect2", "seed": 3}


def test_measuring_by_markers_adds_tape_to_a_simulated_cell(tmp_path: Path):
    sapien = CELLS / "sapien.yaml"
    found = read_cell(sapien, noise=None, measure="markers", tape=None)
    assert found.tape is not None and found.tape.sides == (0.012, 0.008) and found.values["colour_scale"] == 3
    found = read_cell(sapien, noise=None, measure="markers", tape=(0.01, 0.006))
    assert found.values["tape"] == {"large": 0.01, "small": 0.006}
    path = tmp_path / "cell.yaml"
    path.write_text("type: sapien\ntape: {large: 0.009, small: 0.006}\ncolour_scale: '4'\n")
    found = read_cell(path, noise=None, measure="markers", tape=None)
    assert found.tape is not None and found.tape.sides == (0.009, 0.006) and found.values["colour_scale"] == 4


def test_a_real_cells_file_is_used_in_place(tmp_path: Path):
    """It names files relative to its own folder."""
    real = measured_cell(tmp_path)
    found = read_cell(real, noise=None, measure="markers", tape=None)
    assert found.write(tmp_path) == real and list(tmp_path.iterdir()) == [real]
    assert found.tape is not None and not found.simulated and found.noise == ""
    with pytest.raises(UsageError, match="for a simulated cell"):
        read_cell(real, noise="iid", measure="truth", tape=None)


def test_the_mujoco_cell_takes_noise_and_draws_no_tape(tmp_path: Path):
    path = CELLS / "mujoco.yaml"
    found = read_cell(path, noise="kinect2", measure="truth", tape=None)
    assert found.simulated and found.noise == "kinect2" and found.write(tmp_path) == tmp_path / "cell.yaml"
    with pytest.raises(UsageError, match="draws no tape.*type sapien"):
        read_cell(path, noise=None, measure="markers", tape=None)


def test_parts_that_the_arm_cannot_carry_are_refused_by_name_without_connecting_it(tmp_path: Path):
    """The documented real cell holds 15 N and 15 N m, of which a part's weight may be four fifths."""
    cell = measured_cell(tmp_path)
    light, heavy = (make_box(tmp_path, name, (0.05, 0.05, 0.05), mass) for name, mass in WEIGHTS)
    check_loads(cell, [light])
    with pytest.raises(LoadTooHeavy, match=r"^heavy: the part weighs 1.400 kg, this arm carries") as caught:
        check_loads(cell, [light, heavy])
    assert "\n" not in str(caught.value) and caught.value.exit_code == 1
    check_loads(CELLS / "sapien.yaml", [light, heavy])  # the payload of the data sheet
