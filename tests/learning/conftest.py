from pathlib import Path

import pytest

from mskgrasp.learning.samples import Samples, read_samples
from tests import synthetic
from tests.learning.small import PATCH


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Grasps of eight boxes; not to be changed."""
    return synthetic.write_dataset(tmp_path_factory.mktemp("data"), n_parts=8, n_attempts=80, seed=1)


@pytest.fixture(scope="session")
def samples(dataset: Path) -> Samples:
    """The dataset as the small patch network sees it."""
    return read_samples(dataset, PATCH.network)
