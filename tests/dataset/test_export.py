from __future__ import annotations

import json

import h5py
import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset import list_shards, read_shard
from mskgrasp.dataset.commands.command_line import main
from mskgrasp.dataset.commands.maniskill import export_maniskill
from mskgrasp.dataset.export import export_npz
from tests import synthetic


def test_npz_holds_every_array_of_the_shards_and_needs_no_pickle(collected, joined, tmp_path):
    assert export_npz(collected, tmp_path / "data.npz") == 12
    with np.load(tmp_path / "data.npz", allow_pickle=False) as file:
        for name, values in vars(joined).items():
            assert file[name].dtype == values.dtype
            assert np.array_equal(file[name], values, equal_nan=values.dtype.kind == "f"), name
        infos = [read_shard(path)[1] for path in list_shards(collected)]
        assert [str(name) for name in file["part_names"][file["part"]][::3]] == [info.part for info in infos]
        assert file["shard"].tolist() == [0] * 3 + [1] * 3 + [0] * 3 + [1] * 3
        assert tuple(file["failure_names"].tolist()) == FAILURES
        assert json.loads(str(file["physics_json"])) == infos[0].physics
        assert np.array_equal(file["intrinsics"], infos[0].intrinsics)
        assert [str(h) for h in file["part_hashes"]] == sorted(
            {info.part_hash for info in infos}, key=lambda h: next(i.part for i in infos if i.part_hash == h)
        )
    assert [path.name for path in tmp_path.iterdir()] == ["data.npz"]


def test_wrong_names_and_places_are_usage_errors(collected, tmp_path):
    with pytest.raises(UsageError, match=r"ends in \.npz"):
        export_npz(collected, tmp_path / "data.h5")
    with pytest.raises(UsageError, match=r"ends in \.h5"):
        export_maniskill(collected, tmp_path / "data.npz")
    with pytest.raises(UsageError, match="among the dataset's shards"):
        export_npz(collected, collected / "shards" / "data.npz")
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot make folder"):
        export_npz(collected, tmp_path / "file" / "data.npz")
    with pytest.raises(UsageError, match="does not exist"):
        main(["export", str(tmp_path / "nowhere"), "--format", "npz", "--out", str(tmp_path / "x.npz")])


@pytest.mark.parametrize("export", [export_npz, export_maniskill])
def test_planned_grasps_are_not_exported_beside_random_ones_and_are_called_so(tmp_path, export):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=2, n_attempts=3, seed=0)
    out = tmp_path / "out" / ("x.npz" if export is export_npz else "x.h5")
    for path in list_shards(folder):
        with h5py.File(path, "r+") as file:
            file.attrs["physics"] = '{"lift_height": 0.1}'
    for k, path in enumerate(list_shards(folder)):
        with h5py.File(path, "r+") as file:
            file.attrs["planner"] = "0123"
        if k == 0:
            with pytest.raises(BadDataset, match="planner differs"):
                export(folder, out)
    export(folder, out)
    if export is export_npz:
        assert str(np.load(out)["planner"]) == "0123"
    else:
        assert "chosen by planner 0123" in json.loads(out.with_suffix(".json").read_text())["source_desc"]


@pytest.mark.parametrize("export", [export_npz, export_maniskill])
def test_a_bad_shard_stops_an_export_and_leaves_nothing_behind(tmp_path, export):
    folder = synthetic.write_dataset(tmp_path / "boxes", n_parts=2, n_attempts=3, seed=0)
    path = list_shards(folder)[1]
    with h5py.File(path, "r+") as file:
        file.attrs["table_z"] = 0.1
        file.attrs["physics"] = '{"lift_height": 0.1}'
    with h5py.File(list_shards(folder)[0], "r+") as file:
        file.attrs["physics"] = '{"lift_height": 0.1}'
    out = tmp_path / "out" / ("x.npz" if export is export_npz else "x.h5")
    with pytest.raises(BadDataset, match="table_z differs"):
        export(folder, out)
    assert not list(out.parent.iterdir())
