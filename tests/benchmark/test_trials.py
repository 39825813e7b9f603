"""Tasks of a benchmark, and trials of several planners in one scene."""

from __future__ import annotations

from pathlib import Path

from mskgrasp.benchmark.trials import SceneTask, key_of, scene_tasks
from tests.benchmark.made_trials import made


def test_every_planner_meets_every_scene():
    tasks = scene_tasks(["hex_nut_m20", "hex_nut_m30"], 2, ("ours", "centroid"))
    keys = [key for task in tasks for key in task.keys()]
    assert len(tasks) == 4 and len(set(keys)) == 8
    assert keys[:2] == [("hex_nut_m20", 0, "ours"), ("hex_nut_m20", 0, "centroid")]


def test_what_is_stored_is_not_made_again():
    task = SceneTask(str(Path("parts/nut")), "nut", 3, ("ours", "centroid"))
    found = {key_of(made(3)): made(3)}
    left = task.without(found)
    assert left is not None and left.planners == ("centroid",)
    assert left.without({key_of(made(3, "centroid"))}) is None
    assert task.without({("bolt", 3, "ours"): 0}) == task
