"""Ratings: shares counted from a dataset, and an estimate that can be held against what was measured."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.palette import FAINT, GREEN
from mskgrasp.dataset import rating, read_shard, shard_path, write_shard
from mskgrasp.dataset.rating import draw_ratings, estimate, passing, rate_parts
from mskgrasp.parts.catalogue import Entry, Index, Rating
from tests.figures import picture, tick_labels
from tests.synthetic import write_dataset


def bar(name: str, length: float, successes: int | None) -> Entry:
    rated = None
    if successes is not None:
        rated = Rating(attempts=100, successes=successes, interval=(0.0, 1.0), part_hash=name, dataset="data")
    return Entry(
        name=name, family="bar", source="test", licence="Apache-2.0", longest_axis=length,
        extents=(0.01, 0.02, length), volume=2e-4 * length, mass=0.1, n_hulls=1, hull_error=0.0,
        hull_error_p95=0.0, hull_volume_ratio=1.0, content_hash=name, recipe_hash="r", rating=rated,
    )  # fmt: skip


def bars(rng: np.random.Generator, n: int, rated: int) -> list[Entry]:
    """Bars of which the longer are harder to grasp: 60 % of attempts succeed at 50 mm, none at 150 mm."""
    lengths = rng.uniform(0.05, 0.15, n)
    rate = np.clip(0.6 * (0.15 - lengths) / 0.10, 0, 1)
    return [
        bar(f"bar{i}", float(length), int(rng.binomial(100, p)) if i < rated else None)
        for i, (length, p) in enumerate(zip(lengths, rate, strict=True))
    ]


def test_successes_are_counted_over_all_shards_of_a_part(tmp_path: Path):
    folder = write_dataset(tmp_path, n_parts=2, n_attempts=30, seed=0)
    attempts, info = read_shard(shard_path(folder, "box_0", 0))
    write_shard(shard_path(folder, "box_0", 1), attempts, replace(info, index=1))
    found = rate_parts(folder)
    assert found["box_0"].attempts == 60 and found["box_1"].attempts == 30
    assert found["box_0"].successes == 2 * int(attempts.success.sum())
    low, high = found["box_0"].interval
    assert low < found["box_0"].rate < high
    assert found["box_0"].part_hash == info.part_hash


def test_a_part_that_changed_in_the_middle_is_refused(tmp_path: Path):
    folder = write_dataset(tmp_path, n_parts=1, n_attempts=5, seed=0)
    attempts, info = read_shard(shard_path(folder, "box_0", 0))
    write_shard(shard_path(folder, "box_0", 1), attempts, replace(info, index=1, part_hash="1" * 16))
    with pytest.raises(BadDataset, match="changed while it was collected"):
        rate_parts(folder)


def test_grasps_that_a_planner_chose_rate_no_part(tmp_path: Path):
    folder = write_dataset(tmp_path, n_parts=1, n_attempts=5, seed=0)
    attempts, info = read_shard(shard_path(folder, "box_0", 0))
    write_shard(shard_path(folder, "box_0", 0), attempts, replace(info, planner="0123"))
    with pytest.raises(BadDataset, match="a planner chose these grasps, parts are rated by random ones"):
        rate_parts(folder)


def test_a_damaged_shard_is_named(tmp_path: Path):
    folder = write_dataset(tmp_path, n_parts=1, n_attempts=5, seed=0)
    path = shard_path(folder, "box_0", 0)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(BadDataset, match="box_0-0000.h5"):
        rate_parts(folder)


def test_the_estimate_finds_which_bars_are_neither_easy_nor_hard():
    entries = bars(np.random.default_rng(0), 600, 150)
    others = [entry for entry in entries if entry.rating is None]
    chance = estimate(others, [entry for entry in entries if entry.rating], 0.05, 0.40)
    lengths = np.array([entry.longest_axis for entry in others])
    # 40 % at 83 mm, 5 % at 142 mm.
    assert chance[(lengths > 0.095) & (lengths < 0.13)].min() > 0.8
    assert chance[lengths < 0.065].mean() < 0.05


@pytest.mark.parametrize("seed", range(5))
def test_the_estimated_number_is_within_its_stated_error(seed):
    rng = np.random.default_rng(seed)
    entries = bars(rng, 600, 150)
    index = Index(parts={entry.name: entry for entry in entries}, left_out={})
    inside, expected, error = passing(index, 0.05, 0.40)
    lengths = np.array([entry.longest_axis for entry in entries])
    true = int(((lengths > 0.0833) & (lengths < 0.1417)).sum())
    assert abs(expected - true) < 3 * error + 5
    assert inside == sum(5 <= entry.rating.successes <= 40 for entry in entries if entry.rating)


def test_with_every_part_rated_the_number_is_a_count():
    entries = bars(np.random.default_rng(1), 50, 50)
    index = Index(parts={entry.name: entry for entry in entries}, left_out={})
    inside, expected, error = passing(index, 0.05, 0.40)
    assert expected == inside and error == 0


def test_a_single_rated_part_says_nothing_of_others():
    with pytest.raises(BadDataset, match="fewer than two"):
        estimate([bar("a", 0.1, None)], [bar("b", 0.1, 20)], 0.05, 0.40)


def test_the_picture_shows_each_rated_part_green_within_the_bounds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    figures: list[Figure] = []

    class Kept(Figure):
        def __init__(self, *args: Any, **settings: Any):
            super().__init__(*args, **settings)
            figures.append(self)

    monkeypatch.setattr(rating, "Figure", Kept)
    entries = [bar("low", 0.15, 4), bar("inside", 0.1, 20), bar("high", 0.06, 60), bar("unrated", 0.08, None)]
    index = Index(parts={entry.name: entry for entry in entries}, left_out={})
    picture(draw_ratings(index, (0.05, 0.40), tmp_path / "rating.png"))
    above, families = figures[0].axes
    points = {
        float(line.get_xdata()[0]): (float(line.get_ydata()[0]), line.get_color())
        for line in above.lines
        if line.get_marker() == "o"
    }
    # Longest axis in mm, success in per cent.
    expected = {150.0: (4.0, FAINT), 100.0: (20.0, GREEN), 60.0: (60.0, FAINT)}
    assert sorted(points) == pytest.approx(sorted(expected))
    for length, (rate, colour) in expected.items():
        found = points[min(points, key=lambda one: abs(one - length))]
        assert found[0] == pytest.approx(rate) and found[1] == colour
    assert tick_labels(families) == ["bar"] and len(families.lines) == 3
