from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import FAILURES, pose_base_tcp
from mskgrasp.dataset import read_shard
from mskgrasp.dataset.card import read_card
from mskgrasp.dataset.check import check_dataset
from mskgrasp.dataset.commands.command_line import main
from mskgrasp.dataset.export import export_npz
from tests.collecting import REPOSITORY

KEY, NUT = "parallel_key_a16x10x56", "hex_nut_m30"


@pytest.fixture
def data(collected: Path, tmp_path: Path) -> Path:
    """A copy of a simulated dataset, to be damaged."""
    return Path(shutil.copytree(collected, tmp_path / "data"))


def shard(data: Path, name: str = f"{KEY}-0000.h5") -> Path:
    return data / "shards" / name


def faults(data: Path) -> dict[str, str]:
    """What the check finds: file name to its reasons."""
    found: dict[str, str] = {}
    for fault in check_dataset(data).faults:
        assert "\n" not in fault.reason
        found[fault.path.name] = found.get(fault.path.name, "") + fault.reason + "; "
    return found


def only(data: Path, name: str = f"{KEY}-0000.h5") -> str:
    """The reasons of the one file that is bad."""
    found = faults(data)
    assert list(found) == [name], found
    return found[name]


def put(path: Path, column: str, index, value) -> None:
    with h5py.File(path, "r+") as file:
        file[column][index] = value


def replace(path: Path, column: str, array: np.ndarray) -> None:
    with h5py.File(path, "r+") as file:
        kept = dict(file[column].attrs)
        del file[column]
        file[column] = array
        file[column].attrs.update(kept)


def attribute(path: Path, name: str, value) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs[name] = value


def held(data: Path) -> tuple[Path, int]:
    """A shard with a success, and its row."""
    for path in sorted((data / "shards").glob("*.h5")):
        rows = np.flatnonzero(read_shard(path)[0].success)
        if len(rows):
            return path, int(rows[-1])
    raise AssertionError("the small dataset has no success")


def test_what_the_collector_makes_is_sound(collected, capsys):
    assert main(["check", str(collected)]) == 0
    assert "sound, 4 shards, 12 attempts" in capsys.readouterr().out


def test_the_program_names_each_bad_shard_and_fails(data):
    shard(data).write_bytes(shard(data).read_bytes()[:5000])
    put(shard(data, f"{NUT}-0001.h5"), "grasp", (1, 2), np.nan)
    done = subprocess.run(
        [sys.executable, "-m", "mskgrasp.dataset", "check", str(data)],
        capture_output=True, text=True, cwd=REPOSITORY, timeout=120,
    )  # fmt: skip
    assert done.returncode == 1 and "Traceback" not in done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith(f"shards/{NUT}-0001.h5: grasp of attempt 1 is not finite")
    assert lines[1].startswith(f"shards/{KEY}-0000.h5: is damaged")
    assert "2 bad files" in lines[2] and len(lines) == 3


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.97])
def test_a_truncated_shard_is_named(data, share):
    content = shard(data).read_bytes()
    shard(data).write_bytes(content[: int(share * len(content))])
    assert "damaged" in only(data)


def test_a_damaged_image_is_named(data):
    with h5py.File(shard(data)) as file:
        place = file["depth"].id.get_chunk_info(1)
    content = bytearray(shard(data).read_bytes())
    for offset in range(place.byte_offset + 30, place.byte_offset + 60):
        content[offset] ^= 0xFF
    shard(data).write_bytes(bytes(content))
    assert "damaged" in only(data)


@pytest.mark.parametrize(
    "column",
    [
        "grasp",
        "displacement",
        "tilt",
        "width_after",
        "pose_base_obj",
        "pose_tcp_obj_before",
        "pose_tcp_obj_after",
    ],
)
def test_a_flipped_bit_in_a_number_is_reported_by_the_others(data, column):
    path, row = held(data)
    with h5py.File(path) as file:
        stored = file[column]
        offset = stored.id.get_offset() + row * stored.id.get_storage_size() // len(stored)
    content = bytearray(path.read_bytes())
    content[offset + 3] ^= 0x40  # the highest bit of the exponent of the row's first float32
    path.write_bytes(bytes(content))
    assert f"attempt {row}" in only(data, path.name) or column in only(data, path.name)


def test_a_column_of_another_type_or_length_is_named(data):
    replace(shard(data), "tilt", np.zeros(3, np.float64))
    assert "tilt is float64, must be float32" in only(data)
    replace(shard(data), "tilt", np.zeros(2, np.float32))
    assert "tilt has shape (2,)" in only(data)


@pytest.mark.parametrize(
    ("column", "array", "words"),
    [
        ("grasp", np.float32(0.5), r"grasp has shape \(\), must be \(3, 4\)"),
        ("success", np.array([b"yes", b"no", b"no"], object), "success is object, must be bool"),
        ("success", np.bool_(True), r"success has shape \(\), must be \(3, \)"),
    ],
    ids=["scalar grasp", "success as text", "scalar success"],
)
def test_a_column_that_is_no_list_of_its_type_is_named(data, column, array, words):
    replace(shard(data), column, array)
    assert re.search(words, only(data))
    with pytest.raises(BadDataset, match=words):
        read_shard(shard(data))


def test_a_success_with_a_failure_that_has_no_name_is_named(data):
    path, row = held(data)
    put(path, "failure", row, 200)
    assert only(data, path.name) == f"failure 200 of attempt {row}, legal 0..{len(FAILURES) - 1}; "
    with pytest.raises(BadDataset, match="failure 200"):
        read_shard(path)


def test_labels_that_contradict_each_other_are_named(data):
    path, row = held(data)
    put(path, "failure", row, FAILURES.index("missed"))
    assert "success True with failure 1 (missed)" in only(data, path.name)
    put(path, "success", row, False)
    assert "is given though it failed" in only(data, path.name)


def test_a_success_that_moved_over_five_centimetres_is_named(data):
    path, row = held(data)
    attempts, _ = read_shard(path)
    # Consistent in itself: the pose afterwards tells the same; x of the grasp frame is x of the TCP's.
    put(path, "displacement", (row, 0), attempts.displacement[row, 0] + 0.06)
    put(path, "pose_tcp_obj_after", (row, 0), attempts.pose_tcp_obj_after[row, 0] + 0.06)
    reason = only(data, path.name)
    assert f"attempt {row} is called a success but moved" in reason and "at most 50" in reason
    assert "does not follow" not in reason


def test_a_displacement_that_does_not_follow_from_the_poses_is_named(data):
    path, row = held(data)
    put(path, "displacement", (row, 1), read_shard(path)[0].displacement[row, 1] + 0.002)
    assert "does not follow from its poses before and after (2.00 mm off)" in only(data, path.name)


def shift_grasp(path: Path, change: np.ndarray) -> None:
    """Moves the first grasp, and the poses that follow from it, so that nothing else is wrong."""
    attempts, _ = read_shard(path)
    grasp = (attempts.grasp[0].astype(float) + change).astype(np.float32)
    before = pose_base_tcp(grasp.astype(float)).inverse() @ Pose.from_vector(
        attempts.pose_base_obj[0].astype(float)
    )
    put(path, "grasp", 0, grasp)
    put(path, "pose_tcp_obj_before", 0, before.as_vector())
    put(path, "success", 0, False)
    put(path, "failure", 0, FAILURES.index("missed"))
    for column in ("displacement", "tilt"):
        put(path, column, 0, np.nan)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((0.4, 0, 0, 0), "outside the region"),
        ((0, 0, -0.06, 0), "the lowest is"),
        ((0, 0, 0.5, 0), "the highest is"),
        ((0, 0, 0, 4.0), "has theta"),
    ],
)
def test_a_grasp_where_none_is_sampled_is_named(data, change, words):
    shift_grasp(shard(data), np.array(change, dtype=float))
    assert words in only(data)


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.1, "none is under 0.2"), (2.0, "below the table"), (0.0, "without one valid pixel")],
)
def test_depth_in_another_unit_is_named(data, factor, words):
    with h5py.File(shard(data)) as file:
        depth = file["depth"][:]
    put(shard(data), "depth", 2, (depth[2] * factor).astype(np.uint16))
    assert "attempt 2 has" in only(data) and words in only(data)


def test_a_swapped_hash_is_named(data):
    with h5py.File(shard(data, f"{NUT}-0000.h5")) as file:
        other = file.attrs["part_hash"]
    attribute(shard(data), "part_hash", other)
    assert f"is that of part '{NUT}'" in only(data)


def test_a_hash_that_differs_from_the_parts_other_shards_is_named(data):
    attribute(shard(data), "part_hash", "0123456789abcdef")
    assert "part_hash 0123456789ab differs from the part's" in only(data)


def test_a_renamed_shard_is_named_and_missed(data):
    shard(data).rename(shard(data, f"{KEY}-0007.h5"))
    found = faults(data)
    assert set(found) == {f"{KEY}-0000.h5", f"{KEY}-0007.h5"}
    assert "missing" in found[f"{KEY}-0000.h5"]
    assert f"holds shard 0 of part '{KEY}', but is not called {KEY}-0000.h5" in found[f"{KEY}-0007.h5"]


def test_a_shard_that_is_there_twice_is_named(data):
    shutil.copy(shard(data), shard(data, f"{NUT}-0009.h5"))
    assert "which parallel_key_a16x10x56-0000.h5 holds, too (duplicate)" in only(data, f"{NUT}-0009.h5")
    shard(data, f"{NUT}-0009.h5").unlink()
    shutil.copy(shard(data), shard(data, f"{KEY}-0001.h5"))
    attribute(shard(data, f"{KEY}-0001.h5"), "index", 1)
    assert f"holds the same attempts as {KEY}-0000.h5 (duplicate)" in only(data, f"{KEY}-0001.h5")


@pytest.mark.parametrize(("difference", "missing"), [(-0.05, True), (0.05, False)])
def test_a_part_outside_the_range_of_success_needs_its_first_shard_alone(data, difference, missing):
    rate = float(read_shard(shard(data, f"{NUT}-0000.h5"))[0].success.mean())
    settings = yaml.safe_load((data / "config.yaml").read_text())
    settings["part_filter"] = dict(min_success=rate + difference)
    (data / "config.yaml").write_text(yaml.safe_dump(settings))
    shard(data, f"{NUT}-0001.h5").unlink()
    assert (f"{NUT}-0001.h5" in faults(data)) == missing


def test_missing_shards_and_parts_are_named(data):
    shard(data, f"{NUT}-0001.h5").unlink()
    assert "is missing" in only(data, f"{NUT}-0001.h5")
    shard(data, f"{NUT}-0000.h5").unlink()
    assert list(faults(data)) == [f"{NUT}-0000.h5", f"{NUT}-0001.h5"]


def test_a_part_may_be_given_by_its_folder_and_every_part_that_was_asked_for_is_there(data):
    settings = yaml.safe_load((data / "config.yaml").read_text())
    for folder in ("a_copy", "../parts/a_copy"):
        settings["parts"] = [folder if name == NUT else name for name in (NUT, KEY)]
        (data / "config.yaml").write_text(yaml.safe_dump(settings))
        assert not faults(data)
    settings["parts"] = [NUT, KEY, "part_of_elsewhere"]
    (data / "config.yaml").write_text(yaml.safe_dump(settings))
    (reason,) = faults(data).values()
    assert reason == "names 1 more parts than there are shards of; not found: part_of_elsewhere; "


def test_settings_that_ask_for_absurdly_many_shards_are_answered_at_once(data):
    settings = yaml.safe_load((data / "config.yaml").read_text())
    settings |= {"attempts_per_part": 10**12, "shard_size": 1}
    (data / "config.yaml").write_text(yaml.safe_dump(settings))
    missing = [fault.reason for fault in check_dataset(data).faults if "is missing" in fault.reason]
    assert 100 < len(missing) < 1000 and any("others are not named" in reason for reason in missing)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("intrinsics", np.zeros((3, 3)), "intrinsics are those of no pinhole camera"),
        (
            "intrinsics",
            [[300.0, 0, 80], [0, 300, 80], [0, 0, 0]],
            "intrinsics are those of no pinhole camera",
        ),
        ("discarded", '{"a": "x"}', "attribute discarded is no JSON object of such values"),
        ("versions", '{"simulation": [1]}', "attribute versions is no JSON object of such values"),
    ],
)
def test_a_damaged_property_is_a_fault_and_ends_no_program(data, name, value, said):
    attribute(shard(data), name, value)
    assert said in only(data)
    with pytest.raises(BadDataset, match=said):
        read_card(data)


def test_an_image_without_pixels_is_a_fault(data):
    with h5py.File(shard(data), "r+") as file:
        n = len(file["success"])
        del file["depth"]
        file["depth"] = np.zeros((n, 0, 0), np.float32)
    assert "its images are empty" in only(data)


def test_a_failure_without_a_name_ends_the_card_in_a_line(data):
    path, row = next(
        (path, rows[0])
        for path in sorted((data / "shards").glob("*.h5"))
        if len(rows := np.flatnonzero(~read_shard(path)[0].success))
    )
    put(path, "failure", row, 200)
    with pytest.raises(BadDataset, match="failure counts what has no name"):
        read_card(data)


def test_a_shard_with_too_few_attempts_is_named(data):
    with h5py.File(shard(data), "r+") as file:
        for column in list(file):
            values, kept = file[column][:2], dict(file[column].attrs)
            del file[column]
            file[column] = values
            file[column].attrs.update(kept)
    assert "holds 2 attempts, 2 with those discarded, must be 3" in only(data)
    attribute(shard(data), "discarded", '{"part_not_seen": 1}')
    assert faults(data) == {}
    attribute(shard(data), "discarded", '{"part_not_seen": -1}')
    assert "discarded counts no attempts" in only(data)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", 6),
        ("table_z", 0.004),
        ("region", [0.38, 0.62, -0.12, 0.121]),
        ("intrinsics", [[366.0, 0, 79.5], [0, 366.0, 79.5], [0, 0, 1]]),
        ("physics", '{"rate_hz": 250}'),
        ("fidelity", "gpu"),
        ("hand", '{"pad_width": 0.02}'),
        ("noise", '{"finger_force": [5.0, 70.0]}'),
        ("planner", "0123"),
        ("family", "spoon"),
    ],
)
def test_a_shard_of_other_settings_is_named(data, name, value):
    attribute(shard(data), name, value)
    assert f"{name} " in only(data) and "differs from the" in only(data)


def test_settings_that_changed_after_the_shards_were_made_are_named(data):
    settings = yaml.safe_load((data / "config.yaml").read_text())
    settings["physics"]["finger_force"] = 40.0
    (data / "config.yaml").write_text(yaml.safe_dump(settings))
    assert "physics.finger_force is 40.0, the shards were made with 30.0" in only(data, "config.yaml")
    (data / "config.yaml").unlink()
    assert "cannot read configuration" in only(data, "config.yaml")


def test_a_dataset_made_with_settings_that_no_longer_exist_is_sound_and_exported(data, tmp_path):
    settings = yaml.safe_load((data / "config.yaml").read_text())
    # As simulation version 2 stored it.
    settings["physics"] |= dict(coarse_rate_hz=250, coarse_mass=0.04)
    (data / "config.yaml").write_text(yaml.safe_dump(settings))
    for path in (data / "shards").iterdir():
        attribute(path, "physics", json.dumps(settings["physics"]))
    assert faults(data) == {}
    assert read_card(data).physics["coarse_mass"] == 0.04
    assert export_npz(data, tmp_path / "data.npz") == 12
    with np.load(tmp_path / "data.npz") as stored:
        assert json.loads(str(stored["physics_json"])) == settings["physics"]


def test_foreign_files_are_named_and_leftovers_only_noted(data):
    (data / "shards" / "notes.txt").write_text("hello")
    assert "foreign" in only(data, "notes.txt")
    (data / "shards" / "notes.txt").unlink()
    (data / "shards" / "other.h5").write_text("no HDF5")
    assert "no HDF5" in only(data, "other.h5")
    (data / "shards" / "other.h5").unlink()
    (data / "shards" / f"{NUT}-0000.h5.0123.tmp").write_bytes(b"half")
    report = check_dataset(data)
    assert not report.faults and "killed run" in report.notes[0]


def test_a_folder_that_is_no_dataset_is_a_usage_error(tmp_path):
    for folder, words in ((tmp_path / "nowhere", "does not exist"), (tmp_path, "no folder shards")):
        with pytest.raises(UsageError, match=words):
            check_dataset(folder)


def test_a_part_whose_name_leads_out_of_the_folder_hides_no_other_fault(data):
    shard(data, f"{KEY}-0001.h5").unlink()
    for name in ("../../x", "/x", "a" * 300):
        attribute(shard(data), "part", name)
        found = faults(data)
        assert len(found) >= 2 and any("is missing" in reason for reason in found.values())
