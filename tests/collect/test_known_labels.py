"""Labels of planned grasps: restored without their model, and never beside random ones."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import pytest

from mskgrasp.collect.__main__ import main
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.dataset.check import check_dataset
from mskgrasp.dataset.labels import export_labels
from tests.collecting import PARTS, arguments
from tests.programs import run_here


@pytest.fixture(scope="module")
def planned(collected: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset as if a planner had chosen its grasps, which lacks a shard of its first part."""
    folder = tmp_path_factory.mktemp("planned") / "data"
    shutil.copytree(collected, folder)
    for path in list_shards(folder):
        with h5py.File(path, "r+") as file:
            file.attrs["planner"] = "0123456789"
    (folder / "shards" / f"{PARTS[0]}-0001.h5").unlink()
    return folder


@pytest.fixture(scope="module")
def labels(planned: Path) -> Path:
    file = planned.parent / "planned.labels"
    export_labels(planned, file)
    return file


def test_parts_that_the_labels_hold_are_restored_and_the_others_left_out(planned, labels, tmp_path):
    done = run_here(main, *arguments(tmp_path / "data", "--labels", str(labels)))
    assert done.returncode == 0, done.stderr
    assert "1 of 2 parts are left out: labels lack attempts at them" in done.stderr
    made = list_shards(tmp_path / "data")
    assert [path.name for path in made] == [f"{PARTS[1]}-000{k}.h5" for k in (0, 1)]
    assert all(read_shard(path)[1].planner == "0123456789" for path in made)
    assert not check_dataset(tmp_path / "data").faults


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--planned-by", str(PRETRAINED)), "another planner chose their grasps; leave planned_by out"),
        (("--part-filter.min-success", "0.1"), "these are planned: leave them out"),
        (("--attempts-per-part", "9"), "they hold all attempts of none of the parts"),
    ],
)
def test_what_does_not_fit_labels_of_planned_grasps_is_refused(labels, tmp_path, options, message):
    done = run_here(main, *arguments(tmp_path / "data", "--labels", str(labels), *options))
    assert done.returncode == 2 and message in done.stderr.strip().splitlines()[-1]
    assert not (tmp_path / "data").exists()


def test_labels_of_random_and_of_planned_grasps_are_not_restored_together(collected, tmp_path):
    export_labels(collected, tmp_path / "random.labels")
    lone = tmp_path / "lone"
    shutil.copytree(collected, lone)
    for path in list_shards(lone)[1:]:
        path.unlink()
    with h5py.File(list_shards(lone)[0], "r+") as file:
        file.attrs["index"] = 7
        file.attrs["planner"] = "0123456789"
    export_labels(lone, tmp_path / "lone.labels")
    both = (str(tmp_path / "random.labels"), str(tmp_path / "lone.labels"))
    done = run_here(main, *arguments(tmp_path / "data", "--labels", *both))
    assert done.returncode == 2 and "hold grasps that were chosen differently" in done.stderr
    done = run_here(main, *arguments(tmp_path / "data", "--labels", both[0], "--planned-by", str(PRETRAINED)))
    assert done.returncode == 2 and "their grasps are random; leave planned_by out" in done.stderr
