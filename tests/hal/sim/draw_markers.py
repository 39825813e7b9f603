"""Measures tape squares and draws docs/markers.png. Run ``python -m tests.hal.sim.draw_markers``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hal import Cell
from mskgrasp.core.errors import MarkersNotFound
from mskgrasp.perception.markers import Markers
from tests.hal.sim.marked_parts import (
    GREY_NOISE,
    PARTS,
    Motion,
    errors,
    find,
    littered,
    marked_cell,
    noisy,
    place_part,
    present,
    random_motion,
    small_motion,
)

OUT = Path(__file__).parents[3] / "docs" / "markers.png"
N_MOTIONS = 20
N_LITTERED = 500
SHOWN = "pillow_block_80x32"
SIDE = 75
BLUE, ORANGE = "#1f6feb", "#e8590c"


def main() -> None:
    """Moves every part, prints the errors as a table, and draws them."""
    figure = Figure(figsize=(11.5, 4.0), layout="constrained")
    panels = figure.subplots(1, 3, width_ratios=(1, 1, 1.25))
    cell, rng = marked_cell(), np.random.default_rng(0)
    with cell.camera:
        draw_pictures(cell, panels[:2])
        print("| part | clean, mm (max) | degrees (max) | noisy, mm (max) | degrees (max) | refused |")
        print("|---|---|---|---|---|---|")
        every = {"clean": [], "noisy": []}
        for part in PARTS:
            resting = present(cell, part)
            found, refused = measure(cell, [random_motion(cell, resting, rng) for _ in range(N_MOTIONS)], rng)
            for kind, values in found.items():
                every[kind] += values
            if part == SHOWN:
                litter(cell, small_motion(cell, resting), rng)
            print(f"| `{part}` | {row(found['clean'])} | {row(found['noisy'])} | {refused} |")
        print(f"| all | {row(every['clean'])} | {row(every['noisy'])} | |")
    for kind, colour in (("noisy", ORANGE), ("clean", BLUE)):
        label = {"clean": "no noise", "noisy": f"Kinect v2's noise, {GREY_NOISE:g} grey levels"}[kind]
        panels[2].plot(*np.transpose(every[kind]), ".", color=colour, markersize=5, label=label)
    panels[2].set(xlim=(0, 0.5), ylim=(0, 0.5), xlabel="error of the shift (mm)")
    panels[2].set_ylabel("error of the turn (degrees)")
    panels[2].set_title(f"{len(PARTS)} parts, {N_MOTIONS} motions each", loc="left", fontweight="bold")
    panels[2].legend(frameon=False, loc="upper right", fontsize=9)
    panels[2].grid(alpha=0.3)
    figure.savefig(OUT, dpi=110)
    print(f"wrote {OUT}")


def measure(
    cell: Cell, motions: Sequence[Motion], rng: np.random.Generator
) -> tuple[dict[str, list[tuple[float, float]]], int]:
    """Errors (mm, degrees) without and with noise, and how often the squares were not found."""
    found: dict[str, list[tuple[float, float]]] = {"clean": [], "noisy": []}
    refused = 0
    for motion in motions:
        for kind, frames in (
            ("clean", motion.frames),
            ("noisy", tuple(noisy(frame, rng) for frame in motion.frames)),
        ):
            try:
                found[kind].append(errors(cell, motion, frames))
            except MarkersNotFound as error:
                refused += 1
                print(f"{kind}: {error}")
    return found, refused


def litter(cell: Cell, motion: Motion, rng: np.random.Generator) -> None:
    """Prints what becomes of pictures on which something lies on or beside a square."""
    found = []
    for frame in littered(cell, motion.frames[1], N_LITTERED, rng):
        try:
            found.append(errors(cell, motion, (motion.frames[0], frame)))
        except MarkersNotFound:
            continue
    most = np.max(found, axis=0)
    print(f"of {N_LITTERED} littered pictures {len(found)} were not refused, errors up to {most} mm, degrees")


def row(values: Sequence[tuple[float, float]]) -> str:
    """RMS and greatest error, as two cells of a table."""
    rms, most = np.sqrt(np.mean(np.square(values), axis=0)), np.max(values, axis=0)
    return " | ".join(f"{r:.2f} ({m:.2f})" for r, m in zip(rms, most, strict=True))


def draw_pictures(cell: Cell, panels: Sequence[Axes]) -> None:
    """One part before and after a motion, with what was found."""
    resting = present(cell, SHOWN)
    seen: list[Markers] = []
    for axes, (title, x, y, turn) in zip(
        panels, (("before", 0.5, 0.0, 0.35), ("after", 0.506, -0.005, 0.6)), strict=True
    ):
        place_part(cell, resting, x, y, turn)
        frame = cell.camera.capture()
        assert frame.fine_colour is not None
        seen.append(find(cell, frame))
        middle = frame.fine_colour.shape[0] // 2
        axes.imshow(frame.fine_colour[middle - SIDE : middle + SIDE, middle - SIDE : middle + SIDE])
        for markers, colour in zip(seen, ((BLUE, ORANGE) if len(seen) == 2 else (BLUE,)), strict=True):
            pixels = (markers.pixels + 0.5) * 3 - 0.5 - (middle - SIDE)
            axes.plot(*pixels.T, "+-", color=colour, linewidth=1.2, markersize=12)
        axes.set_title(title, loc="left", fontweight="bold")
        axes.set(xticks=[], yticks=[])


if __name__ == "__main__":
    main()
