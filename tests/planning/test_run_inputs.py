from dataclasses import replace

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.planning.certified import certified_folder, read_certified
from mskgrasp.planning.run_inputs import (
    calibration_digest,
    certified_digests,
    inputs_of,
    keep_certified,
    kept_certified,
    part_digests,
)
from tests.boxes import make_box
from tests.planning.test_certified import certified, certified_grasp


def test_the_digests_name_every_input_and_change_with_its_content(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    make_box(tmp_path / "cache", "block", (0.05, 0.03, 0.02), 0.1)
    cell, models = tmp_path / "cell.yaml", tmp_path / "model"
    models.mkdir()
    for path in (models / "model.json", models / "model.safetensors"):
        path.write_text("first")
    cell.write_text("camera: {driver: kinect2, calibration: kinect2.yaml}")
    before = inputs_of(cell, models, ["block"])
    assert set(before) == {"cell", "model.json", "model.safetensors", "part block"}
    (models / "model.safetensors").write_text("second")
    after = inputs_of(cell, models, ["block"])
    assert {name for name in before if before[name] != after[name]} == {"model.safetensors"}
    make_box(tmp_path / "other", "block", (0.05, 0.03, 0.021), 0.1)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert part_digests(["block"]) != {"part block": before["part block"]}


def test_a_camera_that_was_calibrated_again_is_another_input(tmp_path):
    cell, calibration = tmp_path / "cell.yaml", tmp_path / "kinect2.yaml"
    cell.write_text("camera: {driver: kinect2, calibration: kinect2.yaml}")
    assert calibration_digest(cell) == {}
    calibration.write_text("first")
    before = calibration_digest(cell)
    calibration.write_text("second")
    assert set(before) == {"calibration"} and calibration_digest(cell) != before
    cell.write_text("type: sapien")
    assert calibration_digest(cell) == {}


def test_another_folder_with_a_part_of_the_same_name_is_another_input(tmp_path):
    folders = [
        make_box(tmp_path / name, "block", (0.05, 0.03, height), 0.1).folder
        for name, height in (("a", 0.02), ("b", 0.021))
    ]
    first, second = (part_digests([str(folder)]) for folder in folders)
    assert set(first) == set(second) == {"part block"} and first != second


def test_other_certified_grasps_of_a_part_are_another_input(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    box = make_box(tmp_path, "block", (0.05, 0.03, 0.02), 0.1)
    with pytest.raises(UsageError, match="cannot read"):
        certified_digests([str(box.folder)])
    certified_folder(box).mkdir(parents=True)
    found = []
    for lifted in (23, 23, 24):
        certified(certified_grasp(lifted=lifted)).write(certified_folder(box))
        found.append(certified_digests([str(box.folder)]))
    assert set(found[0]) == {"certified grasps of block"} and found[0] == found[1] != found[2]


def test_a_run_keeps_the_certified_grasps_with_which_it_was_begun(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    box = make_box(tmp_path, "block", (0.05, 0.03, 0.02), 0.1)
    certified_folder(box).mkdir(parents=True)

    def write(lifted: int) -> None:
        own = replace(certified(certified_grasp(lifted=lifted)), part="block", part_hash=box.content_hash)
        replace(own, stands=(True,) * len(box.resting_probability)).write(certified_folder(box))

    out, source = tmp_path / "run", str(box.folder)
    out.mkdir()
    (out / "inputs.json").write_text("{}")  # of a run that has begun
    write(23)
    keep_certified(out, [source])
    write(24)  # by another program, while the run goes on
    assert read_certified(box).grasps[0].lifted == 24
    assert read_certified(box, kept_certified(out, box)).grasps[0].lifted == 23
    with pytest.raises(UsageError, match="certified grasps of block"):
        keep_certified(out, [source])
    write(23)
    keep_certified(out, [source])
