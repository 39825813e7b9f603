"""Scenes of a benchmark."""

from __future__ import annotations

from mskgrasp.benchmark.trials import scene_tasks


def test_every_planner_meets_every_scene():
    tasks = scene_tasks(["hex_nut_m20", "hex_nut_m30"], "sapien.yaml", 2, ("ours", "centroid"))
    keys = [key for task in tasks for key in task.keys()]
    assert len(tasks) == 4 and len(set(keys)) == 8
    assert keys[:2] == [("hex_nut_m20", "sapien.yaml", 0, name) for name in ("ours", "centroid")]
