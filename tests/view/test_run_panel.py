"""Panel of a run."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from mskgrasp.core.errors import BadConfig
from mskgrasp.core.geometry import Pose
from mskgrasp.trials.trial_files import write_trial
from mskgrasp.view.page import Page
from mskgrasp.view.run_panel import RunPanel, region_of, trial_text
from mskgrasp.view.stored_run import StoredTrial
from tests.planning.hand_made import FRAME, planner
from tests.view.conftest import has_node, node, pose_of, work

PLAN = planner().plan(FRAME, np.random.default_rng(0))
POSE = Pose(position=np.array([0.45, 0.02, 0.015]), quat_wxyz=np.array([1.0, 0, 0, 0]))
SHIFT = np.array([0.001, 0.0, 0.0, 0.0])


def trials(folder: Path) -> list[StoredTrial]:
    file, picture = folder / "one.npz", folder / "two.png"
    write_trial(file, FRAME, PLAN, None)
    cv2.imwrite(str(picture), np.full((6, 9, 3), (255, 0, 0), np.uint8))
    return [
        StoredTrial(
            name="one", part="hex_nut_m30", outcome="lifted", file=file, grasp=PLAN.grasp.as_vector(),
            predicted=SHIFT, measured=SHIFT, point_base=POSE.position, T_base_obj=POSE,
        ),
        StoredTrial(
            name="two", part="no_such_part", outcome="placed", picture=picture, grasp=PLAN.grasp.as_vector(),
            target=np.array([0.5, 0.06, 0.5]),
        ),
        StoredTrial(name="three", part="no_such_part", outcome="lifted", file=file, T_base_obj=POSE),
    ]  # fmt: skip


def test_each_trial_is_drawn_with_what_is_stored_of_it(page: Page, tmp_path: Path):
    panel = RunPanel(page, tmp_path, trials(tmp_path))
    panel.shown()
    np.testing.assert_array_equal(pose_of(page, "/run/trial/before").position, POSE.position)
    assert len(node(page, "/run/plan/candidates/points").points) == len(PLAN.candidates)
    off = pose_of(page, "/run/plan/measured").position - POSE.position
    assert abs(np.linalg.norm(off) - 0.001) < 1e-9
    panel.choice.value = "two"
    work(page)
    assert not has_node(page, "/run/plan/candidates") and has_node(page, "/run/trial/hand")
    np.testing.assert_allclose(pose_of(page, "/run/trial/target").position[:2], [0.5, 0.06])
    assert panel.picture.visible and panel.picture.image.shape == (6, 9, 3)
    assert tuple(panel.picture.image[0, 0]) == (0, 0, 255)
    panel.choice.value = "three"
    work(page)
    assert not panel.picture.visible and not has_node(page, "/run/trial/before")
    assert hasattr(node(page, "/run/plan/expected"), "points")  # a part that is not here: as it was seen


def test_the_region_of_a_run_is_its_cells_wherever_the_camera_is(page: Page, tmp_path: Path):
    assert region_of(tmp_path) is None  # of another than a simulated cell
    panel = RunPanel(page, tmp_path, trials(tmp_path))
    panel.shown()
    assert panel.view._shown is not None
    x_min, x_max, y_min, y_max = panel.view._shown.region
    assert [(x_min + x_max) / 2, (y_min + y_max) / 2] == pytest.approx(PLAN.view.centre_base[:2])
    (tmp_path / "cell.yaml").write_text("type: sapien\nregion: [0.4, 0.5, -0.1, 0.0]\n")
    panel = RunPanel(page, tmp_path, trials(tmp_path))
    panel.shown()
    assert panel.view._shown is not None and panel.view._shown.region == (0.4, 0.5, -0.1, 0.0)


@pytest.mark.parametrize("region", ["5", "null", "[1, 2, 3]", "[a, b, c, d]"])
def test_a_damaged_region_is_an_error_of_one_line(tmp_path: Path, region: str):
    (tmp_path / "cell.yaml").write_text(f"region: {region}\n")
    with pytest.raises(BadConfig, match="is not x_min, x_max, y_min, y_max$"):
        region_of(tmp_path)


def test_a_height_that_was_not_measured_is_said_to_be_so():
    measured = np.array([0.001, 0.0, np.nan, 0.0])
    text = trial_text(StoredTrial(name="a", part="a", outcome="lifted", measured=measured))
    assert "nan" not in text and "dz not measured" in text
