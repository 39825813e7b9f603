"""Summary of a collection, against numbers worked out by hand."""

from __future__ import annotations

import dataclasses
import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from mskgrasp.collect.config import PartFilter
from mskgrasp.collect.report import draw_summary, print_summary, summarise_parts, write_summary
from mskgrasp.core.grasp import FAILURES
from mskgrasp.dataset import Attempts, shard_path, write_shard
from tests import synthetic
from tests.figures import picture


def rows(attempts: Attempts, which: np.ndarray | slice) -> Attempts:
    return Attempts(**{name: values[which] for name, values in vars(attempts).items()})


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Part a in two shards: 3 of 5 lifted, moved by 5, 13 and 1 mm; part b: 0 of 2."""
    folder = tmp_path_factory.mktemp("data")
    plain = synthetic.random_attempts(7, (0.05, 0.02, 0.03), np.random.default_rng(0))
    success = np.array([1, 0, 1, 0, 1, 0, 0], bool)
    moved = np.full((7, 4), np.nan, np.float32)
    moved[success] = [[0.003, 0.004, 0, -0.2], [0.003, 0.004, 0.012, 0.1], [0, 0, -0.001, 0.4]]
    missed, slipped = FAILURES.index("missed"), FAILURES.index("slipped")
    attempts = dataclasses.replace(
        plain, success=success, displacement=moved,
        failure=np.array([0, missed, 0, slipped, 0, missed, missed], np.uint8),
        tilt=np.where(success, [0.01, 0, 0.03, 0, 0.02, 0, 0], np.nan).astype(np.float32),
        width_after=np.where(success, 0.02, 0.0).astype(np.float32),
        pose_tcp_obj_after=plain.pose_tcp_obj_before,
    )  # fmt: skip
    write_shard(shard_path(folder, "a", 0), rows(attempts, slice(0, 3)), synthetic.info("a"))
    write_shard(
        shard_path(folder, "a", 1),
        rows(attempts, slice(3, 5)),
        dataclasses.replace(synthetic.info("a", 1), redrawn=7),
    )
    write_shard(shard_path(folder, "b", 0), rows(attempts, slice(5, 7)), synthetic.info("b"))
    return folder


def test_a_part_is_summed_up_over_its_shards(dataset: Path):
    a, b = summarise_parts(dataset, PartFilter(min_success=0.1))
    assert (a.part, a.attempts, a.successes, a.kept) == ("a", 5, 3, True)
    # 2 of 3 in the first shard, by which the collector decides, 3 of 5 in all.
    assert not summarise_parts(dataset, PartFilter(max_success=0.62))[0].kept
    assert a.median_displacement == pytest.approx(0.005) and a.median_turn == pytest.approx(0.2)
    assert a.median_tilt == pytest.approx(0.02)
    assert a.failures == {"missed": 1, "slipped": 1} and a.discarded == {"unsettled": 2}
    assert a.redrawn == 7
    # Wilson (1927) for 3 of 5, as tabulated.
    assert a.success_interval == pytest.approx((0.231, 0.882), abs=1e-3)
    assert (b.successes, b.median_displacement, b.kept) == (0, None, False)
    assert b.failures == {"missed": 2}


def test_the_table_has_a_row_for_each_part_and_the_sums(dataset: Path):
    stream = io.StringIO()
    print_summary(summarise_parts(dataset, PartFilter(max_success=0.5)), Console(file=stream, width=200))
    lines = [line.split("  ") for line in stream.getvalue().splitlines()]
    cells = {line[0].strip(): [cell.strip() for cell in line[1:] if cell.strip()] for line in lines}
    assert cells["a"] == [
        "5", "60.0%", "23% - 88%", "5.0 mm", "11.5 deg", "missed 1, slipped 1", "unsettled 2", "no",
    ]  # fmt: skip
    assert cells["b"] == ["2", "0.0%", "0% - 66%", "-", "-", "missed 2", "unsettled 1", "yes"]
    assert cells["all 2"] == ["7", "42.9%", "missed 3, slipped 1", "unsettled 3", "1 parts"]


def test_the_file_holds_the_same_numbers(dataset: Path, tmp_path: Path):
    summaries = summarise_parts(dataset, PartFilter())
    write_summary(summaries, tmp_path)
    stored = json.loads((tmp_path / "summary.json").read_text())
    assert stored["schema_version"] == 1
    assert [row["part"] for row in stored["parts"]] == ["a", "b"]
    assert stored["parts"][0]["failures"] == summaries[0].failures
    assert stored["parts"][1]["median_turn"] is None


def test_a_picture_is_drawn_of_a_dataset_with_empty_shards_and_shards_of_failures_alone(tmp_path: Path):
    attempts = synthetic.random_attempts(2, (0.05, 0.02, 0.03), np.random.default_rng(1))
    failed = dataclasses.replace(
        attempts, success=np.zeros(2, bool), failure=np.ones(2, np.uint8),
        displacement=np.full((2, 4), np.nan, np.float32),
    )  # fmt: skip
    write_shard(shard_path(tmp_path, "a", 0), failed, synthetic.info("a"))
    write_shard(shard_path(tmp_path, "b", 0), rows(attempts, slice(0, 0)), synthetic.info("b"))
    assert [row.attempts for row in summarise_parts(tmp_path, PartFilter())] == [2, 0]
    assert picture(draw_summary(tmp_path, seed=0)).shape[1] > 500
