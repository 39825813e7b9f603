from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from mskgrasp.core.settings import TABLE_Z
from mskgrasp.dataset import depth_to_u16
from mskgrasp.perception.part_detection import view_part
from tasks.scene.renderer import render_backend


@pytest.fixture(scope="module")
def seeing(boxes):
    made = gymnasium.make(
        "GraspDisplacement-v1",
        parts=[str(boxes["light"].folder)],
        obs_mode="none",
        render_backend=render_backend(),
    )
    yield made.unwrapped
    made.close()


def place(env, x: float, y: float) -> np.ndarray:
    env.reset(seed=0, options=dict(pose_base_obj=np.array([[x, y, 0.015, 1, 0, 0, 0]])))
    return env.capture_depth()[0].cpu().numpy()


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.463, 0.071), (0.5671, -0.0433), (0.44, -0.08)])
def test_every_pixel_shows_what_the_pinhole_says(seeing, x, y):
    """The box's top is 0.77 m below the camera; a pixel sees it if its centre's ray meets it."""
    depth = place(seeing, x, y)
    focal, centre = 365.5, 79.5
    rows, columns = np.mgrid[0:160, 0:160]
    base_x = 0.5 - (rows - centre) / focal * 0.77
    base_y = -(columns - centre) / focal * 0.77
    expected = (np.abs(base_x - x) < 0.02) & (np.abs(base_y - y) < 0.01)
    seen = np.abs(depth - 0.77) < 1e-3
    assert (expected != seen).sum() == 0
    assert np.abs(depth[seen] - 0.77).max() < 5e-6
    assert np.abs(depth[:20] - 0.8).max() < 5e-6


def test_the_robot_is_not_in_the_picture_unless_asked_for(seeing):
    place(seeing, 0.5, 0.0)  # at the task's home the hand hangs over the table
    assert float(seeing.capture_depth().min()) > 0.7
    with_robot = seeing.capture_rgbd(with_robot=True)[1]
    assert float(with_robot.min()) < 0.7


def test_the_seen_box_is_the_real_box(seeing):
    depth = place(seeing, 0.463, 0.071)
    view = view_part(
        depth,
        seeing.overhead.intrinsics(),
        seeing.overhead.T_base_camera(seeing.region_centre),
        table_z=TABLE_Z,
        region=seeing.region,
    )
    assert view.centre_base == pytest.approx([0.463, 0.071, 0.015], abs=1.1e-3)
    assert sorted(view.size) == pytest.approx([0.02, 0.03, 0.04], abs=2.2e-3)


def test_beyond_the_table_nothing_is_seen_and_a_shard_holds_no_depth(boxes):
    env = gymnasium.make(
        "GraspDisplacement-v1", parts=[str(boxes["light"].folder)], obs_mode="none",
        render_backend=render_backend(), camera=dict(height=2.5),
    ).unwrapped  # fmt: skip
    depth = place(env, 0.5, 0.0)
    env.close()
    rows, columns = np.mgrid[0:160, 0:160]
    base_x = 0.5 - (rows - 79.5) / 365.5 * 2.5
    base_y = -(columns - 79.5) / 365.5 * 2.5
    # The table ends at x = 0.95 and y = 0.7; a pixel beside its edge may see either.
    off = np.maximum(np.abs(base_x - 0.45) - 0.5, np.abs(base_y) - 0.7)
    assert np.isnan(depth[off > 0.01]).all() and (off > 0.01).sum() > 100
    assert np.isfinite(depth[off < -0.01]).all()
    assert not depth_to_u16(depth)[off > 0.01].any()
