"""Planners by name, and what is said of names that cannot be used."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from hal import cell_from_yaml
from mskgrasp.benchmark.config import BenchmarkConfig
from mskgrasp.benchmark.planners import Planners, PlannerSettings, check_planners, package_digests
from mskgrasp.core.errors import BadConfig, BadPart, UsageError
from mskgrasp.core.shipped import PRETRAINED, config_file
from mskgrasp.parts import find_part
from mskgrasp.planning.planner import Planner
from tests import synthetic
from tests.synthetic import Box

PART = find_part("hex_nut_m20")
FRAME = synthetic.frame([Box(x=0.45, y=0.02, yaw=0.4, size=(0.06, 0.02, 0.03))])


@pytest.fixture
def planners(tmp_path):
    with ExitStack() as stack:
        cell = cell_from_yaml(config_file("cells/sapien.yaml"))
        yield Planners(cell, PlannerSettings(models=PRETRAINED, out=tmp_path, paper_models=PRETRAINED), stack)


@pytest.mark.parametrize("name", ["centroid", "antipodal"])
def test_a_planner_without_a_model_predicts_nothing(name, planners):
    plan = planners.of(name, PART).plan(FRAME, np.random.default_rng(0))
    assert np.isnan(plan.quality) and not plan.displacement.any()


def test_a_bound_on_the_quality_is_all_that_tells_ours_apart(planners):
    ours, bounded = planners.of("ours", PART), planners.of("ours-min-quality", PART)
    assert isinstance(ours, Planner) and isinstance(bounded, Planner)
    assert (ours.config.least_quality, bounded.config.least_quality) == (0.0, 0.5)
    assert bounded.config.model_copy(update={"min_quality": None}) == ours.config
    assert planners.of("ours", PART) is ours  # loaded once


def test_the_papers_planner_chooses_as_the_paper_does(planners):
    paper, ours = planners.of("paper", PART), planners.of("ours", PART)
    assert paper.config == ours.config.model_copy(update={"recentre": False, "sure_quality": 0.0})


def test_certified_grasps_that_were_not_made_are_named(planners, tmp_path: Path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(BadPart, match="no certified grasps of 'hex_nut_m20'; make them"):
        planners.of("certified", PART)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        (dict(planners=("paper",)), UsageError, "planner 'paper' needs --paper-models"),
        (dict(planners=("program",)), UsageError, "planner 'program' needs --program"),
        (dict(planners=("ours",), program="x"), UsageError, "--planners does not name program"),
        (dict(planners=("program",), program="no-such-program -x"), UsageError, "there is no such program"),
        (dict(planners=("program",), program="python 'a"), UsageError, "No closing quotation; close the"),
        (dict(planners=("ors",)), BadConfig, "--planners is 'ors'; legal: centroid, antipodal, paper, ours"),
    ],
)
def test_a_planner_that_cannot_run_is_refused_first(settings, error, message):
    with pytest.raises(error, match=message):
        check_planners(BenchmarkConfig(**settings))
    check_planners(BenchmarkConfig())


def test_planners_of_this_program_are_of_no_package():
    assert package_digests(("ours", "program", "theirs")) == {"planner theirs": "None"}


@pytest.mark.parametrize("edited", ["mine.py", "mine_pack/__init__.py", "mine_pack/deep/nets.py"])
def test_an_edit_of_a_planners_code_is_noticed(edited, tmp_path: Path, monkeypatch):
    module = edited.partition("/")[0].removesuffix(".py")
    info = tmp_path / "my_planner-1.0.dist-info"
    (tmp_path / "mine_pack" / "deep").mkdir(parents=True)
    info.mkdir()
    for name in ("mine.py", "mine_pack/__init__.py", "mine_pack/deep/nets.py"):
        (tmp_path / name).write_text("raise SystemExit('imported')")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my_planner\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[mskgrasp.planners]\nmy_planner = {module}:make_planner\n")
    monkeypatch.syspath_prepend(tmp_path)
    before = package_digests(("my_planner", "ours"))
    (tmp_path / "other.py").write_text("of another package")
    # What editors and notebooks leave in a package.
    (tmp_path / "mine_pack" / ".#nets.py").symlink_to("nobody@nowhere")
    (tmp_path / "mine_pack" / ".ipynb_checkpoints").mkdir()
    (tmp_path / "mine_pack" / ".ipynb_checkpoints" / "nets.py").write_text("old")
    (tmp_path / "mine_pack" / "folder.py").mkdir()
    assert package_digests(("my_planner", "ours")) == before
    (tmp_path / edited).write_text("edited")
    after = package_digests(("my_planner", "ours"))
    assert {name for name in after if after[name] != before[name]} == {"code of planner my_planner"}
    assert after["planner my_planner"] == "my_planner 1.0"
