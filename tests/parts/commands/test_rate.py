"""The command ``rate`` on a dataset of two parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.dataset import list_shards, read_success
from mskgrasp.parts.catalogue import Entry, Index, read_index, write_index
from mskgrasp.parts.commands.rate import Rate, run_rate
from tests.synthetic import write_dataset


def entry(name: str, part_hash: str) -> Entry:
    return Entry(
        name=name, family="box", source="test", licence="Apache-2.0", longest_axis=0.05,
        extents=(0.01, 0.02, 0.05), volume=1e-5, mass=0.1, n_hulls=1, hull_error=0.0, hull_error_p95=0.0,
        hull_volume_ratio=1.0, content_hash=part_hash, recipe_hash="r",
    )  # fmt: skip


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A dataset whose two parts are in the catalogue, which has a third one."""
    folder = write_dataset(tmp_path, n_parts=2, n_attempts=30, seed=0)
    hashes = {read_success(path)[1].part: read_success(path)[1].part_hash for path in list_shards(folder)}
    parts = {name: entry(name, digest) for name, digest in hashes.items()}
    write_index(Index(parts=parts | {"other": entry("other", "0")}, left_out={}))
    return folder


def test_rates_are_stored_in_the_index_and_reported(data: Path, capsys: pytest.CaptureFixture[str]):
    assert run_rate(Rate(data=data)) == 0
    won = {read_success(path)[1].part: read_success(path)[0] for path in list_shards(data)}
    parts = read_index().parts
    for name, success in won.items():
        rating = parts[name].rating
        assert rating is not None and (rating.attempts, rating.successes) == (30, int(np.sum(success)))
    assert parts["other"].rating is None
    out = capsys.readouterr().out
    row = next(line.split() for line in out.splitlines() if line.startswith("box"))
    assert row[1:4] == ["3", "2", "60"]
    assert "of 2 rated parts lie within 5% - 40%; of all 3 parts of the catalogue" in out
    assert out.splitlines()[-1] == "2 parts rated" and (data / "rating.png").stat().st_size > 10_000


@pytest.mark.parametrize("bounds", [(0.4, 0.05), (-0.1, 0.4), (0.05, 40)])
def test_bounds_that_are_no_shares_in_order_are_refused(data: Path, bounds: tuple[float, float]):
    with pytest.raises(UsageError, match="give 0 <= low < high <= 1"):
        run_rate(Rate(data=data, low=bounds[0], high=bounds[1]))


def test_ratings_of_a_part_of_another_shape_are_refused_and_nothing_is_stored(data: Path):
    index = read_index()
    write_index(Index(parts={**index.parts, "box_1": entry("box_1", "changed")}, left_out={}))
    with pytest.raises(BadPart, match="'box_1' has changed"):
        run_rate(Rate(data=data))
    assert all(part.rating is None for part in read_index().parts.values())
