import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset, UsageError
from mskgrasp.dataset import open_dataset, read_shard


def test_columns_join_the_shards_in_order_and_name_each_row_s_part(collected):
    dataset = open_dataset(collected)
    table = dataset.columns("grasp", "success")
    attempts = [read_shard(path) for path in dataset.paths]
    np.testing.assert_array_equal(table["grasp"], np.concatenate([one.grasp for one, _ in attempts]))
    assert table["part"].tolist() == [info.part for one, info in attempts for _ in range(len(one))]
    assert set(table) == {"grasp", "success", "part"}


def test_all_columns_but_the_images_are_read_by_default(collected):
    table = open_dataset(collected).columns()
    assert "depth" not in table and {"grasp", "displacement", "tilt", "pose_base_obj"} <= set(table)


def test_shards_of_one_part_alone(collected):
    dataset = open_dataset(collected)
    name = dataset.part_names[-1]
    found = [info.part for _, info in dataset.shards([name])]
    assert found and set(found) == {name}


def test_an_unknown_column_and_a_missing_folder_are_distinguished(collected, tmp_path):
    with pytest.raises(UsageError, match=r"no column grip; legal: depth, grasp"):
        open_dataset(collected).columns("grip")
    with pytest.raises(BadDataset, match="no dataset folder"):
        open_dataset(tmp_path / "nothing")
