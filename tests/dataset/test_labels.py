"""Labels without images: what they round, and what is refused."""

from __future__ import annotations

import json
import resource
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.dataset import list_shards, read_shard, write_shard
from mskgrasp.dataset.attempts import COLUMNS
from mskgrasp.dataset.commands.command_line import main
from mskgrasp.dataset.labels import export_labels, read_labels
from tests import synthetic


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return synthetic.write_dataset(tmp_path / "boxes", n_parts=2, n_attempts=40, seed=3)


def test_labels_are_those_of_the_shards_to_a_micrometre(folder: Path, tmp_path: Path):
    out = tmp_path / "boxes.labels"
    assert main(["export", str(folder), "--format", "labels", "--out", str(out)]) == 0
    found = read_labels([out])
    assert len(found) == len(list_shards(folder))
    for path in list_shards(folder):
        attempts, info = read_shard(path)
        labels = found[info.part, info.index]
        for name in (
            "seed",
            "physics",
            "noise",
            "versions",
            "discarded",
            "part_hash",
            "family",
            "region",
            "hand",
        ):
            assert getattr(labels.info, name) == getattr(info, name), name
        assert np.array_equal(labels.info.intrinsics, info.intrinsics)
        held = attempts.success
        assert held.any() and not held.all()
        for name, column in COLUMNS.items():
            if name == "depth":
                continue
            rows = held if column.finite == "successful" else np.ones(len(held), bool)
            ours, theirs = labels.columns[name], getattr(attempts, name)
            assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
            assert ours[rows] == pytest.approx(theirs[rows], abs=3e-6, nan_ok=True), name
        assert np.isnan(labels.columns["displacement"][~held]).all()


def test_an_unknown_force_or_friction_stays_unknown(folder: Path, tmp_path: Path):
    path = list_shards(folder)[0]
    attempts, info = read_shard(path)
    some = np.arange(len(attempts)) % 2 == 0
    changes = {
        name: np.where(some, np.nan, getattr(attempts, name)).astype(np.float32)
        for name in ("finger_force", "friction_pad_part")
    }
    write_shard(path, replace(attempts, **changes), info)
    export_labels(folder, tmp_path / "boxes.labels")
    found = read_labels([tmp_path / "boxes.labels"])[info.part, info.index].columns
    for name, values in changes.items():
        assert found[name] == pytest.approx(values, abs=1e-4, nan_ok=True), name


@pytest.mark.parametrize("changes", [{"fidelity": "gpu"}, {"hand": {"pad_width": 0.02}}], ids=str)
def test_shards_of_another_fidelity_or_hand_are_not_exported_with_the_others(
    folder: Path, tmp_path: Path, changes: dict
):
    path = list_shards(folder)[1]
    attempts, info = read_shard(path)
    write_shard(path, attempts, replace(info, **changes))
    with pytest.raises(BadDataset, match=f"{next(iter(changes))} differs from the other shards'"):
        export_labels(folder, tmp_path / "boxes.labels")


def test_labels_are_a_small_part_of_the_dataset(tmp_path: Path):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=1, n_attempts=400, seed=3)
    export_labels(folder, tmp_path / "boxes.labels")
    assert (tmp_path / "boxes.labels").stat().st_size < 400 * 60 + 15_000


def test_a_file_that_cannot_be_written_is_named_and_leaves_nothing(folder: Path, tmp_path: Path, request):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    request.addfinalizer(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limits))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    with pytest.raises(OSError, match="File too large") as raised:
        export_labels(folder, tmp_path / "boxes.labels")
    assert raised.value.filename == str(tmp_path / "boxes.labels") and list(tmp_path.iterdir()) == [folder]


def test_bad_files_are_refused_by_name(folder: Path, tmp_path: Path):
    out = tmp_path / "boxes.labels"
    export_labels(folder, out)
    with pytest.raises(UsageError, match="exists"):
        export_labels(folder, out)
    with pytest.raises(UsageError, match=r"ends in \.labels"):
        export_labels(folder, tmp_path / "boxes.npz")
    with pytest.raises(BadDataset, match="again; name each file once"):
        read_labels([out, out])
    with pytest.raises(BadDataset, match="no file of labels"):
        read_labels([tmp_path / "none.labels"])
    with pytest.raises(BadDataset, match="no file of labels"):
        read_labels([list_shards(folder)[0]])
    with h5py.File(out, "r+") as file:
        del file["grasp"]
        file["grasp"] = np.zeros((3, 4), np.float32)
    with pytest.raises(BadDataset, match="do not fit its shards"):
        read_labels([out])
    out.write_bytes(out.read_bytes()[:500])
    with pytest.raises(BadDataset, match=r"boxes\.labels is damaged"):
        read_labels([out])


@pytest.mark.parametrize(
    "changes",
    [{"n": float("inf")}, {"part": [1]}, {"index": "a"}, {"discarded": [1]}, {"discarded": {"a": -1}}],
)
def test_a_damaged_shard_is_an_error_of_one_line(folder: Path, tmp_path: Path, changes: dict):
    out = tmp_path / "boxes.labels"
    export_labels(folder, out)
    with h5py.File(out, "r+") as file:
        shards = json.loads(np.asarray(file["shards"]).tobytes())
        shards[0] |= changes
        del file["shards"]
        file["shards"] = np.frombuffer(json.dumps(shards).encode(), np.uint8)
    with pytest.raises(BadDataset, match=r"boxes\.labels is damaged") as caught:
        read_labels([out])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("shape", "dtype"),
    [((4 * 10**8,), "S100000"), ((10**9, 4), "f4"), ((80, 5), "f4"), ((80, 4), "i4"), ((80,), "f4")],
)
def test_an_array_of_another_type_or_size_is_refused_unread(
    folder: Path, tmp_path: Path, shape: tuple[int, ...], dtype: str
):
    out = tmp_path / "boxes.labels"
    export_labels(folder, out)
    with h5py.File(out, "r+") as file:
        del file["grasp"]
        file.create_dataset("grasp", shape=shape, dtype=dtype, chunks=True)
    with pytest.raises(BadDataset, match=r"boxes\.labels is damaged .*grasp claims the type"):
        read_labels([out])


def test_an_array_in_another_file_is_refused(folder: Path, tmp_path: Path):
    out = tmp_path / "boxes.labels"
    export_labels(folder, out)
    with h5py.File(out, "r+") as file:
        del file["grasp"]
        file["grasp"] = h5py.ExternalLink(str(list_shards(folder)[0]), "grasp")
    with pytest.raises(BadDataset, match="no array of its own"):
        read_labels([out])
