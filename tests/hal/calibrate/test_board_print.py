"""The printed board, read back from the file."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from hal.calibrate import run as calibrate
from hal.calibrate.board_print import print_board
from hal.charuco import Board, detect
from mskgrasp.core.errors import UsageError
from tests.programs import run_here


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """(h, w, 3) shares of white, 600 dpi."""
    path = tmp_path_factory.mktemp("print") / "board.png"
    assert run_here(calibrate.main, "--print-board", str(path)).returncode == 0
    return matplotlib.image.imread(path)[..., :3]


def test_the_printed_board_is_the_board_at_its_true_size(printed: np.ndarray):
    page = (printed[::4, ::4] * 255).astype(np.uint8)  # 600 dpi to 150
    assert page.shape[1] == pytest.approx(0.297 / 0.0254 * 150, abs=1)
    board = Board()
    found = detect(board, page)
    assert len(found.ids) == board.n_corners
    metres = found.pixels * 0.0254 / 150
    expected = board.corners()[found.ids, :2]
    assert metres - metres.mean(0) == pytest.approx(expected - expected.mean(0), abs=2e-4)


def test_the_ruler_is_a_hundred_millimetres_long(printed: np.ndarray):
    mm = 25.4 / 600
    foot = printed[-round(25 / mm) :, :, 0]
    # The longest dark row of the foot is the ruler's line; its first and last tick are half a line wider.
    row = max(foot, key=lambda line: int((line < 0.5).sum()))
    dark = np.flatnonzero(row < 0.5)
    assert (dark[-1] - dark[0] + 1) * mm == pytest.approx(100, abs=0.4)
    assert (dark[0] + dark[-1]) / 2 == pytest.approx(printed.shape[1] / 2, abs=2)


def test_a_board_too_large_for_a4_goes_on_a3(tmp_path: Path):
    path = tmp_path / "board.pdf"
    assert print_board(Board(columns=6, rows=5), path) == "A3"
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", path.read_bytes())
    assert box is not None
    points = [float(value) for value in box.groups()]
    assert points == pytest.approx([420 / 25.4 * 72, 297 / 25.4 * 72], abs=0.01)


@pytest.mark.parametrize(
    ("square", "name", "message"),
    [
        (0.1, "board.pdf", r"a board of 500 x 400 mm fits no paper up to A2; choose smaller squares"),
        (0.04, "board.jpg", r"board.jpg: the name must end in .pdf or .png"),
    ],
)
def test_what_cannot_be_printed_is_one_line_and_no_file(
    tmp_path: Path, square: float, name: str, message: str
):
    with pytest.raises(UsageError, match=message) as caught:
        print_board(Board(square=square, marker=0.75 * square), tmp_path / name)
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())
