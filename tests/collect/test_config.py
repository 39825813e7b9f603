"""Settings of a collection: bounds of the part filter, and what identifies a dataset."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from mskgrasp.collect.config import CollectConfig, PartFilter
from mskgrasp.core.config import read_config
from mskgrasp.core.settings import ExecutionNoise, Physics
from mskgrasp.core.shipped import config_file
from mskgrasp.runtime.options import parse

ROOT = Path(__file__).parents[2]


def test_bounds_of_the_filter_are_inclusive_and_null_switches_one_off():
    both = PartFilter(min_length=0.02, max_length=0.1, min_success=0.05, max_success=0.5)
    assert [both.takes_length(length) for length in (0.019, 0.02, 0.1, 0.101)] == [False, True, True, False]
    assert [both.takes_success(rate) for rate in (0.04, 0.05, 0.5, 0.51)] == [False, True, True, False]
    assert PartFilter(min_length=0.02).takes_length(5.0) and PartFilter().takes_success(0.0)


def test_where_and_by_whom_data_are_made_is_no_part_of_their_identity():
    one = CollectConfig(seed=3, attempts_per_part=7)
    elsewhere = one.model_copy(update=dict(out=Path("x"), workers=9, cluster="auto"))
    assert elsewhere.identity() == one.identity()
    for change in (dict(seed=4), dict(shard_size=50), dict(parts=("nut",)), dict(attempts_per_part=8)):
        assert one.model_copy(update=change).identity() != one.identity()


def test_a_dataset_is_recognised_by_the_settings_stored_in_it(collected: Path):
    stored = read_config(CollectConfig, collected / "config.yaml")
    assert CollectConfig.model_validate(stored.model_dump(mode="json")).identity() == stored.identity()


SHIPPED = {path.stem: path for path in config_file("collect").glob("*.yaml")}


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_shipped_settings_are_of_production_physics_and_collect_into_a_folder_of_their_own(name: str):
    config = read_config(CollectConfig, SHIPPED[name])
    parts = {"demo": (), "planned": ("train", "validation")}  # empty: the starter set
    assert config.parts == parts.get(name, ("catalogue",))
    assert config.attempts_per_part % config.shard_size == 0  # no shard of a few attempts
    learned = name in ("training", "planned")
    drawn = dict(friction_pad_part=(0.3, 0.8), finger_force=(30.0, 70.0)) if learned else {}
    assert config.physics == Physics() and config.noise == ExecutionNoise(**drawn)
    others = [read_config(CollectConfig, path).out for stem, path in SHIPPED.items() if stem != name]
    assert config.out not in others


def test_planned_grasps_are_of_other_scenes_than_random_ones_and_of_no_test_part():
    random, planned = (read_config(CollectConfig, SHIPPED[name]) for name in ("training", "planned"))
    assert random.seed != planned.seed and random.camera == planned.camera
    assert planned.planned_by == Path("mskgrasp/learning/pretrained") and random.planned_by is None
    lengths = [(one.part_filter.min_length, one.part_filter.max_length) for one in (random, planned)]
    assert lengths[0] == lengths[1] and not planned.part_filter.bounds_success


def test_the_paper_s_settings_are_those_of_the_paper():
    """1000 random grasps a part of 2 to 15 cm; parts of which 5 to 40 % of grasps succeed."""
    config = read_config(CollectConfig, SHIPPED["paper"])
    assert config.attempts_per_part == 1000
    bounds = PartFilter(min_length=0.02, max_length=0.15, min_success=0.05, max_success=0.40)
    assert config.part_filter == bounds


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(shard_size=10_001), "shard_size is at most 10000"),
        (dict(physics=dict(rate_hz=249)), "physics.rate_hz is at least 250: labels made with less are wrong"),
        (dict(physics=dict(coarse_rate_hz=200)), "physics.coarse_rate_hz is at least 250"),
        (dict(camera=dict(n_pixels=100)), "the camera sees 0.22 m of the table, less than the region"),
        (dict(seed=-1), "greater than or equal to 0"),
        (dict(part_filter=dict(min_success=2)), "less than or equal to 1"),
    ],
)
def test_settings_that_would_make_wrong_or_unreadable_data_are_refused(values: dict, message: str):
    with pytest.raises(ValidationError, match=message):
        CollectConfig.model_validate(values)


@pytest.mark.parametrize(
    ("words", "coarse"),
    [("--physics.rate-hz 400", 400), ("--physics.rate-hz 400 --physics.coarse-rate-hz 250", 250)],
)
def test_the_coarse_rate_follows_a_lower_rate_of_the_command_line(words: str, coarse: int):
    config = parse(CollectConfig, prog="p", description="d", argv=words.split())
    assert (config.physics.rate_hz, config.physics.coarse_rate_hz) == (400, coarse)
