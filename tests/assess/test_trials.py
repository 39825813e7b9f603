"""Scenes of an assessment, and their cells."""

from __future__ import annotations

from hal.open_cell import cell_from_yaml
from mskgrasp.assess.trials import CONDITIONS, EXACT, NOISY, PLANNERS, scene_tasks, write_cells
from mskgrasp.parts import find_part


def test_the_exact_camera_has_most_scenes_and_every_condition_some():
    part = find_part("hex_nut_m20")
    for n in (1, 8, 24):
        counts = [sum(task.condition == name for task in scene_tasks(part, n)) for name in CONDITIONS]
        assert counts[0] == n and min(counts) >= 1 and counts == sorted(counts, reverse=True)
    first, *_ = many = scene_tasks(part, 24)
    assert first.keys() == [("hex_nut_m20", EXACT, 0, planner) for planner in PLANNERS]
    assert [task for task in many if task in scene_tasks(part, 8)] == scene_tasks(part, 8)


def test_cells_differ_in_what_their_names_say(tmp_path):
    cells = {name: cell_from_yaml(path) for name, path in write_cells(tmp_path, clearance=0.003).items()}
    assert {cell.workspace.clearance for cell in cells.values()} == {0.003}
    assert set(cells) == set(CONDITIONS)
    frictions = {name: cell.physics.friction_pad_part for name, cell in cells.items()}
    assert (frictions["friction 0.3"], frictions["friction 0.8"]) == (0.3, 0.8)
    assert frictions[EXACT] == frictions[NOISY] == 0.5
    assert "kinect2" in (tmp_path / "cell-Kinect_v2_noise.yaml").read_text()
    assert "noise" not in (tmp_path / "cell-exact_camera.yaml").read_text()
