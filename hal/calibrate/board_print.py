"""Printable calibration board at true scale."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hal.charuco import Board
from mskgrasp.core.errors import UsageError
from mskgrasp.core.files import write_figure

_INCH = 0.0254
_PAPERS = {"A4": (0.297, 0.210), "A3": (0.420, 0.297), "A2": (0.594, 0.420)}
_BORDER = 0.010
"""White border that printers leave, and that the hand may cover, metres."""
_FOOT = 0.022
_RULER = 0.1


def print_board(board: Board, path: Path) -> str:
    """Draw the board at true scale with a ruler to check it by, as PDF or PNG.

    Returns:
        The name of the paper.

    Raises:
        UsageError: The board fits no paper up to A2, or the file is neither PDF nor PNG.
    """
    if path.suffix not in (".pdf", ".png"):
        raise UsageError(f"--print-board {path}: the name must end in .pdf or .png")
    width, height = board.size
    for paper, page in _PAPERS.items():  # noqa: B007 (what the loop ended with is used)
        if width + 2 * _BORDER <= page[0] and height + 2 * _BORDER + _FOOT <= page[1]:
            break
    else:
        raise UsageError(
            f"a board of {width * 1e3:.0f} x {height * 1e3:.0f} mm fits no paper up to A2; choose smaller "
            "squares (--board.square, --board.marker) or fewer"
        )
    figure = Figure(figsize=(page[0] / _INCH, page[1] / _INCH))
    FigureCanvasAgg(figure)
    left, bottom = (page[0] - width) / 2, (page[1] + _FOOT - height) / 2
    axes = figure.add_axes((left / page[0], bottom / page[1], width / page[0], height / page[1]))
    # Forty pixels a square: an edge of the pattern never falls inside one where marker/square is 3/4.
    axes.imshow(board.image(40), cmap="gray", vmin=0, vmax=255, interpolation="nearest", aspect="auto")
    axes.set_axis_off()
    foot = figure.add_axes((0, 0, 1, (bottom - 0.004) / page[1]))
    foot.set_xlim(0, page[0])
    foot.set_ylim(0, bottom - 0.004)
    foot.set_axis_off()
    ruler = (page[0] - _RULER) / 2
    y = _BORDER + 0.010
    foot.plot([ruler, ruler + _RULER], [y, y], color="black", linewidth=0.6)
    for k in range(11):
        x = ruler + k * _RULER / 10
        foot.plot([x, x], [y, y + (0.003 if k % 5 else 0.005)], color="black", linewidth=0.6)
    foot.text(
        page[0] / 2,
        y - 0.0015,
        f"print at 100 %, no fitting to the page: this ruler is 100 mm long and a square "
        f"{board.square * 1e3:g} mm; glue flat on a stiff plate",
        ha="center",
        va="top",
        fontsize=7,
    )
    write_figure(figure, path, dpi=600)
    return paper
