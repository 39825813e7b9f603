import dataclasses
import os

import h5py
import numpy as np
import pytest

from mskgrasp import dataset
from mskgrasp.core.errors import BadDataset, MissingDataset
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import object_displacement
from mskgrasp.dataset import (
    Attempts,
    list_shards,
    read_shard,
    shard_path,
    write_shard,
)
from mskgrasp.dataset.labels import export_labels, read_labels
from mskgrasp.dataset.shards import require_own_name
from tests import synthetic
from tests.programs import no_file_opens


@pytest.fixture(scope="module")
def attempts() -> Attempts:
    rows = synthetic.random_attempts(12, (0.05, 0.02, 0.03), np.random.default_rng(3))
    assert 0 < rows.success.sum() < len(rows)
    return rows


@pytest.fixture
def shard(tmp_path, attempts):
    path = shard_path(tmp_path, "box_1", 3)
    write_shard(path, attempts, synthetic.info("box_1", index=3, seed=9))
    return path


def complaint(call) -> str:
    with pytest.raises(BadDataset) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_what_is_written_is_read_again(shard, attempts):
    again, info = read_shard(shard)
    for field in dataclasses.fields(Attempts):
        stored, given = getattr(again, field.name), getattr(attempts, field.name)
        assert stored.dtype == given.dtype
        assert np.array_equal(stored, given, equal_nan=stored.dtype.kind == "f")
    given = synthetic.info("box_1", index=3, seed=9)
    for name in ("part", "part_hash", "family", "index", "seed", "table_z", "region", "physics", "discarded"):
        assert getattr(info, name) == getattr(given, name)
    assert np.array_equal(info.intrinsics, given.intrinsics)
    assert np.allclose(info.T_base_camera.as_matrix(), given.T_base_camera.as_matrix())


def test_stored_displacements_follow_from_the_stored_poses(shard):
    rows, _ = read_shard(shard)
    before = Pose.from_vector(rows.pose_tcp_obj_before[rows.success])
    after = Pose.from_vector(rows.pose_tcp_obj_after[rows.success])
    measured, _ = object_displacement(before, after)
    assert np.allclose(measured, rows.displacement[rows.success], atol=1e-5)


def test_the_same_attempts_give_the_same_bytes(tmp_path, attempts):
    paths = [shard_path(tmp_path / name, "box", 0) for name in "ab"]
    for path in paths:
        write_shard(path, attempts, synthetic.info("box"))
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_depth_is_stored_one_compressed_image_a_chunk_and_units_are_reported(shard):
    with h5py.File(shard) as file:
        depth = file["depth"]
        assert depth.chunks == (1, 160, 160) and depth.compression == "gzip" and depth.shuffle
        assert "0.1 mm" in depth.attrs["unit"] and file["grasp"].attrs["frame"] == "base"
        assert file["failure"].attrs["failure_names"][0] == "none"


def test_a_shard_without_attempts_says_that_all_were_discarded(tmp_path, attempts):
    empty = Attempts(**{f.name: getattr(attempts, f.name)[:0] for f in dataclasses.fields(Attempts)})
    path = shard_path(tmp_path, "box", 0)
    write_shard(path, empty, synthetic.info("box"))
    again, info = read_shard(path)
    assert len(again) == 0 and info.discarded == {"unsettled": 1}


@pytest.mark.parametrize("name", ["../box", "a/b", "", ".hidden", "a b"])
def test_a_part_name_that_is_no_file_name_is_refused(tmp_path, name):
    assert repr(name) in complaint(lambda: shard_path(tmp_path, name, 0))


def test_shards_are_listed_in_order_without_unfinished_ones(tmp_path, attempts):
    for name in ("b", "a"):
        write_shard(shard_path(tmp_path, name, 0), attempts, synthetic.info(name))
    (tmp_path / "shards" / "c-0000.h5.tmp").write_bytes(b"half")
    assert [path.name for path in list_shards(tmp_path)] == ["a-0000.h5", "b-0000.h5"]


def test_missing_and_empty_folders_are_distinguished(tmp_path):
    assert "no dataset folder" in complaint(lambda: list_shards(tmp_path / "nowhere"))
    assert "no shards" in complaint(lambda: list_shards(tmp_path))
    for missing in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(MissingDataset):
            list_shards(missing)
    (tmp_path / "shards").mkdir()
    with pytest.raises(BadDataset, match="no shards") as raised:
        list_shards(tmp_path)
    assert raised.value.exit_code == 1
    assert "no shard" in complaint(lambda: read_shard(tmp_path / "shards" / "a-0000.h5"))


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.6, 0.99])
def test_a_truncated_shard_is_reported(shard, share):
    data = shard.read_bytes()
    shard.write_bytes(data[: int(share * len(data))])
    assert shard.name in complaint(lambda: read_shard(shard))


def test_a_shard_with_a_damaged_image_is_reported(shard):
    with h5py.File(shard) as file:
        place = file["depth"].id.get_chunk_info(4)
    data = bytearray(shard.read_bytes())
    data[place.byte_offset + 20 : place.byte_offset + 60] = b"\0" * 40
    shard.write_bytes(bytes(data))
    assert "damaged" in complaint(lambda: read_shard(shard))


def test_foreign_files_are_reported(tmp_path):
    text, other = tmp_path / "a.h5", tmp_path / "b.h5"
    text.write_text("hello")
    with h5py.File(other, "w") as file:
        file["x"] = 1
    assert "no HDF5" in complaint(lambda: read_shard(text))
    assert "no grasp shard" in complaint(lambda: read_shard(other))


def test_a_file_that_the_system_cannot_open_is_not_called_damaged(shard, tmp_path):
    labels = tmp_path / "a.labels"
    export_labels(tmp_path, labels)
    for path, read in ((shard, read_shard), (labels, lambda path: read_labels([path]))):
        with no_file_opens(), pytest.raises(OSError, match="^.Errno 24. Too many open files: ") as caught:
            read(path)
        assert caught.value.filename == str(path)


def edit(path, change):
    with h5py.File(path, "r+") as file:
        change(file)


def replace(name, array):
    def change(file):
        del file[name]
        file[name] = array

    return change


def test_other_schema_versions_and_missing_arrays_are_reported(shard):
    edit(shard, lambda file: file.attrs.__setitem__("schema_version", 99))
    assert "schema version 99" in complaint(lambda: read_shard(shard))
    edit(shard, lambda file: file.attrs.__setitem__("schema_version", dataset.SCHEMA_VERSION))
    edit(shard, lambda file: file.__delitem__("tilt"))
    assert "lacks the array tilt" in complaint(lambda: read_shard(shard))


def test_a_missing_attribute_is_reported(shard):
    edit(shard, lambda file: file.attrs.__delitem__("region"))
    assert "region" in complaint(lambda: read_shard(shard))


def test_a_wrong_type_or_shape_is_reported(shard):
    edit(shard, replace("depth", np.zeros((12, 160, 160), np.float32)))
    assert "depth is float32, must be uint16" in complaint(lambda: read_shard(shard))
    edit(shard, replace("depth", np.zeros((11, 160, 160), np.uint16)))
    assert "depth has shape" in complaint(lambda: read_shard(shard))


def broken(attempts: Attempts, name: str, row: int, value) -> Attempts:
    array = getattr(attempts, name).copy()
    array[row] = value
    return dataclasses.replace(attempts, **{name: array})


def test_an_array_that_claims_to_be_enormous_is_reported_and_not_read(shard):
    def change(file):
        del file["tilt"]
        file.create_dataset("tilt", shape=(10**12,), dtype="float32", chunks=(1024,))

    edit(shard, change)
    assert "tilt claims the shape (1000000000000,)" in complaint(lambda: read_shard(shard))


@pytest.mark.parametrize("name", ["part", "family", "planner"])
def test_an_attribute_that_is_no_text_is_reported(shard, name):
    edit(shard, lambda file: file.attrs.__setitem__(name, b"a\xff"))
    assert r"(the text 'a\udcff' is not UTF-8); delete it" in complaint(lambda: read_shard(shard))


def test_an_attribute_that_is_no_object_is_reported(shard):
    edit(shard, lambda file: file.attrs.__setitem__("discarded", "[1]"))
    assert "discarded is no JSON object" in complaint(lambda: read_shard(shard))


def test_values_that_contradict_each_other_are_refused_when_writing(tmp_path, attempts):
    held, failed = int(np.flatnonzero(attempts.success)[0]), int(np.flatnonzero(~attempts.success)[0])
    cases = {
        "grasp of attempt": broken(attempts, "grasp", 2, np.nan),
        "displacement of attempt": broken(attempts, "displacement", held, np.nan),
        "must be NaN": broken(attempts, "displacement", failed, 0.0),
        "failure 77": broken(attempts, "failure", failed, 77),
        "with failure": broken(attempts, "failure", held, 1),
        "quaternion of length": broken(attempts, "pose_base_obj", 0, 2.0),
    }
    path = shard_path(tmp_path, "box", 0)
    for words, attempt in cases.items():
        assert words in complaint(lambda attempt=attempt: write_shard(path, attempt, synthetic.info("box")))
    assert not path.parent.exists()


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_crash_while_writing_leaves_nothing_and_an_older_shard_whole(shard, attempts, monkeypatch, call):
    before = shard.read_bytes()

    def crash(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, call, crash)
    for path in (shard, shard_path(shard.parent.parent, "other", 0)):
        with pytest.raises(OSError, match="No space"):
            write_shard(path, attempts, synthetic.info("other"))
    assert [path.name for path in shard.parent.iterdir()] == [shard.name]
    assert shard.read_bytes() == before


def test_what_lies_in_another_file_is_not_read(shard, tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(4 * 12))
    with h5py.File(shard, "r+") as file:
        del file["tilt"]
        file.create_dataset("tilt", shape=(12,), dtype="f4", external=[(str(secret), 0, 48)])
    assert "tilt lies in another file" in complaint(lambda: read_shard(shard))
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["tilt"] = np.zeros(12, np.float32)
    with h5py.File(shard, "r+") as file:
        del file["tilt"]
        file["tilt"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/tilt")
    assert "tilt lies in another file" in complaint(lambda: read_shard(shard))


def test_a_copy_of_a_shard_under_another_name_is_refused(tmp_path):
    own = synthetic.info("box", index=3)
    require_own_name(shard_path(tmp_path, "box", 3), own)
    for other in (
        shard_path(tmp_path, "box", 4),
        shard_path(tmp_path, "box2", 3),
        tmp_path / "box-0003 (copy).h5",
    ):
        with pytest.raises(BadDataset, match=r"holds what box-0003.h5 holds, shard 3 of part 'box'"):
            require_own_name(other, own)
    with pytest.raises(BadDataset, match="cannot be a file name"):
        require_own_name(
            own_path := tmp_path / "x-0000.h5", dataclasses.replace(own, part=f"../{own_path.name}")
        )
