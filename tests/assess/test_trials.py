"""Scenes of an assessment: which there are, and which are still to be made."""

from __future__ import annotations

from hal.open_cell import cell_from_yaml
from mskgrasp.assess.trials import CONDITIONS, EXACT, MEANS, NOISY, SceneTask, scene_tasks, write_cells


def test_the_exact_camera_has_most_scenes_and_every_condition_some():
    for n in (1, 8, 24):
        counts = [sum(task.condition == name for task in scene_tasks(n)) for name in CONDITIONS]
        assert counts[0] == n and min(counts) >= 1 and counts == sorted(counts, reverse=True)
    assert scene_tasks(24)[0] == SceneTask(EXACT, 0, MEANS)
    assert [task for task in scene_tasks(24) if task in scene_tasks(8)] == scene_tasks(8)


def test_trials_that_are_stored_are_left_out():
    task = SceneTask(EXACT, 2, MEANS)
    first, second = task.keys()
    assert task.without({}) == task
    assert task.without({first}) == SceneTask(EXACT, 2, (MEANS[1],))
    assert task.without({first, second}) is None


def test_cells_differ_in_what_their_names_say(tmp_path):
    cells = {name: cell_from_yaml(path) for name, path in write_cells(tmp_path).items()}
    assert set(cells) == set(CONDITIONS)
    frictions = {name: cell.physics.friction_pad_part for name, cell in cells.items()}
    assert (frictions["friction 0.3"], frictions["friction 0.8"]) == (0.3, 0.8)
    assert frictions[EXACT] == frictions[NOISY] == 0.5
    assert "kinect2" in (tmp_path / "cell-Kinect_v2_noise.yaml").read_text()
    assert "noise" not in (tmp_path / "cell-exact_camera.yaml").read_text()
