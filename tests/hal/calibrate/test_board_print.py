"""The printed board, read back from the file."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from hal.calibrate import run as calibrate
from hal.charuco import Board, detect
from tests.programs import run_here


def test_the_printed_board_is_the_board_at_its_true_size(tmp_path: Path):
    path = tmp_path / "board.png"
    assert run_here(calibrate.main, "--print-board", str(path)).returncode == 0
    page = (matplotlib.image.imread(path)[::4, ::4, :3] * 255).astype(np.uint8)  # 600 dpi to 150
    assert page.shape[1] == pytest.approx(0.297 / 0.0254 * 150, abs=1)
    board = Board()
    found = detect(board, page)
    assert len(found.ids) == board.n_corners
    metres = found.pixels * 0.0254 / 150
    expected = board.corners()[found.ids, :2]
    assert metres - metres.mean(0) == pytest.approx(expected - expected.mean(0), abs=2e-4)
