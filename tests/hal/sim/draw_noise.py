"""Draws docs/noise.png: one part, three sensors. Run ``python -m tests.hal.sim.draw_noise``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hal import SensorNoise, open_cell
from hal.sensor_noise import NoiseModel, add_noise

PART = "hex_nut_m30"
SIDE = 34
OUT = Path(__file__).parents[3] / "docs" / "noise.png"
TITLES: dict[NoiseModel, str] = {
    "off": "noise: off",
    "iid": "noise: iid, 3 mm a pixel",
    "kinect2": "noise: kinect2",
}


def main() -> None:
    """Renders the part once and disturbs it three times."""
    argparse.ArgumentParser(description="Draw docs/noise.png anew.").parse_args()
    with open_cell("configs/cells/sapien.yaml") as cell:
        assert cell.feeder is not None
        cell.feeder.present(PART, 0)
        frame = cell.camera.capture()
    table_z = float(np.nanmax(frame.depth))
    row, column = (int(np.median(axis)) for axis in np.nonzero(frame.depth < table_z - 0.005))
    window = np.s_[row - SIDE : row + SIDE, column - SIDE : column + SIDE]
    figure = Figure(figsize=(11.5, 6.2), layout="constrained")
    axes = figure.subplots(2, 3, height_ratios=(3, 1.3), sharex=True)
    for (model, title), above, below in zip(TITLES.items(), axes[0], axes[1], strict=True):
        noise = SensorNoise(model=model, offset=0.0)
        seen = add_noise(frame.depth, frame.intrinsics, noise, np.random.default_rng(0))[window]
        heights = 1e3 * (table_z - seen)
        image = above.imshow(heights, cmap="viridis", vmin=-6, vmax=28, interpolation="nearest")
        above.axhline(SIDE, color="white", linewidth=0.8, linestyle=":")
        above.set_title(title, loc="left", fontweight="bold")
        above.tick_params(left=False, labelleft=False, bottom=False)
        above.set_facecolor("#c92a2a")
        below.plot(heights[SIDE], ".-", color="#1f6feb", linewidth=0.8, markersize=4)
        below.set_ylim(-8, 30)
        below.grid(alpha=0.3)
        below.set_xlabel("pixel (2.2 mm on the table)")
    axes[1][0].set_ylabel("height (mm)")
    figure.colorbar(image, ax=axes[0], label="height over the table (mm); red: nothing measured")
    figure.savefig(OUT, dpi=130)
    print(f"wrote {OUT}")


if __name__ == "__main__":
    main()
