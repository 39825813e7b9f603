"""Height maps of a part: measures, orientation, and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset
from mskgrasp.palletize.height_maps import HeightMaps, read_height_maps, take_height_maps, write_height_maps
from mskgrasp.planning.place_pose import Target
from tests import synthetic
from tests.planning.hand_made import BOX, FRAME, planner

TARGET = Target(x=0.5, y=-0.05, theta=0.3)


@pytest.fixture(scope="module")
def maps() -> HeightMaps:
    """A box before the grasp, and placed 10 mm beside its target along base x."""
    plan = planner().plan(FRAME, np.random.default_rng(0))
    placed = synthetic.Box(x=TARGET.x + 0.01, y=TARGET.y, yaw=BOX.yaw + TARGET.theta, size=BOX.size)
    return take_height_maps(FRAME, synthetic.frame([placed]), plan, TARGET, theta=0.7)


def centre(heights: np.ndarray, side: float) -> np.ndarray:
    """Centre (x, y) of what is high, relative to the middle of the map: x to the right, y up."""
    n = len(heights)
    rows, columns = np.nonzero(heights > 0.5 * heights.max())
    return np.array([columns.mean() - (n - 1) / 2, (n - 1) / 2 - rows.mean()]) * side / n


def test_heights_are_those_of_the_box_over_its_area(maps: HeightMaps):
    x, y, height = BOX.size
    assert maps.before.max() == pytest.approx(height, abs=1e-4) and maps.top == pytest.approx(
        height, abs=2e-3
    )
    area = (maps.before > height / 2).sum() * (maps.side / len(maps.before)) ** 2
    # A pixel of 2 mm covers the cells around its point: the outline grows by one at most on either side.
    assert x * y * 0.95 < area < (x + 5e-3) * (y + 5e-3)
    assert maps.before.min() == 0 and maps.side >= 1.5 * np.hypot(x, y)


def test_before_is_centred_on_the_part_and_after_on_the_target(maps: HeightMaps):
    np.testing.assert_allclose(centre(maps.before, maps.side), [0, 0], atol=1.5e-3)
    np.testing.assert_allclose(centre(maps.after, maps.side), [0.01, 0], atol=1.5e-3)


def test_the_map_is_seen_from_above_with_base_x_to_the_right_and_y_up(maps: HeightMaps):
    for heights, yaw in ((maps.before, BOX.yaw), (maps.after, BOX.yaw + TARGET.theta)):
        rows, columns = np.nonzero(heights > 0.5 * heights.max())
        points = np.stack([columns - columns.mean(), rows.mean() - rows])
        along = np.linalg.svd(points @ points.T)[0][:, 0]
        direction = np.arctan2(along[1], along[0])
        assert abs((direction - yaw + np.pi / 2) % np.pi - np.pi / 2) < np.radians(3)


def test_a_part_that_was_not_placed_has_no_map_afterwards():
    plan = planner().plan(FRAME, np.random.default_rng(0))
    maps = take_height_maps(FRAME, None, plan, TARGET, theta=0.7)
    assert maps.after.size == 0 and (maps.turn, maps.theta) == (0.3, 0.7)
    np.testing.assert_allclose(maps.grasp[:2], plan.grasp.position[:2] - plan.view.centre_base[:2])


def test_maps_are_read_back_equal(maps: HeightMaps, tmp_path: Path):
    write_height_maps(maps, tmp_path / "maps.npz")
    again = read_height_maps(tmp_path / "maps.npz")
    for name, value in vars(maps).items():
        np.testing.assert_allclose(getattr(again, name), value, rtol=1e-6, atol=1e-9, err_msg=name)
    assert [path.name for path in tmp_path.iterdir()] == ["maps.npz"]


def test_a_missing_or_damaged_file_is_an_error_of_one_line(maps: HeightMaps, tmp_path: Path):
    path = tmp_path / "maps.npz"
    write_height_maps(maps, path)
    whole = path.read_bytes()
    middle = len(whole) // 2
    flipped = whole[:200] + bytes(byte ^ 0xFF for byte in whole[200:300]) + whole[300:]
    for content in (None, b"", whole[:middle], flipped, b"\x80\x04N."):
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(BadDataset, match="maps.npz is missing or damaged; start again") as raised:
            read_height_maps(path)
        assert "\n" not in str(raised.value)
    np.savez(path, before=np.zeros((2, 2)))
    with pytest.raises(BadDataset, match="is missing or damaged"):
        read_height_maps(path)
