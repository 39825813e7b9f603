"""Digest of a dataset's outcomes."""

from __future__ import annotations

import shutil

import pytest

from mskgrasp.core.errors import MissingDataset
from mskgrasp.dataset.fingerprint import dataset_fingerprint
from mskgrasp.learning.samples import read_samples
from tests import synthetic
from tests.learning.small import PATCH


def test_it_is_that_of_the_samples_and_another_for_other_outcomes(tmp_path):
    data = synthetic.write_dataset(tmp_path / "data", n_parts=3, n_attempts=20, seed=1)
    found = dataset_fingerprint(data)
    assert found == read_samples(data, PATCH.network, workers=1).fingerprint
    shutil.copytree(data, tmp_path / "copy")
    assert dataset_fingerprint(tmp_path / "copy") == found
    (tmp_path / "copy" / "shards" / "box_2-0000.h5").unlink()
    assert dataset_fingerprint(tmp_path / "copy") != found
    with pytest.raises(MissingDataset):
        dataset_fingerprint(tmp_path / "nowhere")
