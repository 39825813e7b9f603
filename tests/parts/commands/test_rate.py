"""The command ``rate`` on a dataset of two parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadPart, UsageError
from mskgrasp.dataset import list_shards, read_success
from mskgrasp.parts.catalogue import Entry, Index, Rating, read_index, write_index
from mskgrasp.parts.commands.rate import Rate, run_rate
from tests.synthetic import write_dataset


def entry(name: str, part_hash: str) -> Entry:
    return Entry(
        name=name, family="box", source="test", licence="Apache-2.0", longest_axis=0.05,
        extents=(0.01, 0.02, 0.05), volume=1e-5, mass=0.1, n_hulls=1, hull_error=0.0, hull_error_p95=0.0,
        hull_volume_ratio=1.0, content_hash=part_hash, recipe_hash="r",
    )  # fmt: skip


def rated(name: str, family: str, successes: int, attempts: int = 30) -> Entry:
    rating = Rating(
        attempts=attempts, successes=successes, interval=(0.0, 1.0), part_hash="h", dataset="before"
    )
    return replace(entry(name, "h"), family=family, rating=rating)


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


def test_the_interval_of_a_family_is_by_its_parts(data: Path, capsys: pytest.CaptureFixture[str]):
    index = read_index()
    alike = {f"alike_{n}": rated(f"alike_{n}", "alike", 15) for n in range(10)}
    mixed = {f"mixed_{n}": rated(f"mixed_{n}", "mixed", 30 * (n % 2)) for n in range(10)}
    none = {"none_0": rated("none_0", "none", 0, attempts=0)}
    write_index(Index(parts={**index.parts, **alike, **mixed, **none}, left_out={}))
    assert run_rate(Rate(data=data)) == 0
    rows = {line.split()[0]: line.split() for line in capsys.readouterr().out.splitlines() if line.strip()}
    assert rows["alike"][3:5] == rows["mixed"][3:5] == ["300", "50%"]
    assert rows["none"][3] == "0"
    assert rows["alike"][5:8] == ["43%", "-", "57%"]  # 44 - 56 % if independent
    low, high = (float(rows["mixed"][column][:-1]) for column in (5, 7))
    assert high - low > 50  # of 5 of 10: 24 to 76


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
