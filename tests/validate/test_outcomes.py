"""The same grasps under several settings."""

from __future__ import annotations

import numpy as np
import pytest

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.settings import Physics
from mskgrasp.parts import find_part
from mskgrasp.validate.config import Setting
from mskgrasp.validate.outcomes import draw_grasps, run_settings


@pytest.mark.slow
def test_grasps_are_tried_once_and_read_afterwards(tmp_path):
    folders = [find_part("hex_nut_m20").folder]
    settings = [
        Setting(name="plain", physics=Physics(), n=3),
        Setting(name="moved", physics=Physics(), n=2, shift=1e-5),
        Setting(name="again", physics=Physics(), n=3),
    ]
    drawn = draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None)
    counts: list[int] = []
    first = run_settings(settings[:2], drawn, {}, tmp_path, 2, counts.append)
    assert sorted(counts) == [2, 3] and len(first["plain"].success) == 3
    assert first["moved"].index.tolist() == [0, 1] and set(first["moved"].part) == {"hex_nut_m20"}
    assert first["plain"].settled.all()
    times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")}
    second = run_settings(settings, drawn, {}, tmp_path, 1, counts.append)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")} == times
    np.testing.assert_array_equal(first["plain"].displacement, second["again"].displacement)
    assert draw_grasps(folders, 3, 0, tmp_path, 1, lambda _: None) == drawn
    damaged = next((tmp_path / "outcomes").glob("*.npz"))
    damaged.write_bytes(damaged.read_bytes()[:300])
    with pytest.raises(BadDataset, match=f"{damaged.name} is damaged .*; delete it"):
        run_settings(settings, drawn, {}, tmp_path, 1, counts.append)


@pytest.mark.slow
def test_parts_that_a_setting_does_not_change_are_left_out(tmp_path):
    folders = [find_part("hex_nut_m20").folder]
    drawn = draw_grasps(folders, 1, 0, tmp_path, 1, lambda _: None)
    setting = Setting(name="other hulls", physics=Physics(), n=1, hulls="exact")
    found = run_settings([setting], drawn, {"other hulls": {}}, tmp_path, 1, lambda _: None)
    assert len(found["other hulls"].success) == 0 and found["other hulls"].displacement.shape == (0, 4)
