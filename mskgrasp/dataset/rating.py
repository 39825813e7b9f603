"""Ratings of parts: success rate of random grasps, and an estimate for parts without attempts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mskgrasp.core.errors import BadDataset
from mskgrasp.core.files import write_figure
from mskgrasp.core.metrics import wilson_interval
from mskgrasp.core.palette import FAINT, GREEN, PALE_GREEN
from mskgrasp.dataset import list_shards, read_success
from mskgrasp.parts.catalogue import Entry, Index, Rating

NEIGHBOURS = 7
_MOST_COLUMNS = 4
_SAME_FAMILY = 0.35
"""Penalty in the distance to parts of another family: that of edges which differ by 40 %."""


def rate_parts(folder: Path) -> dict[str, Rating]:
    """Rate every part in a dataset.

    Raises:
        BadDataset: The folder holds no dataset, or a part changed while it was collected.
    """
    outcomes: dict[str, list[np.ndarray]] = defaultdict(list)
    hashes: dict[str, str] = {}
    for path in list_shards(folder):
        success, info = read_success(path)
        if info.planner:
            raise BadDataset(
                f"{path}: a planner chose these grasps, parts are rated by random ones; collect without "
                "--planned-by"
            )
        if hashes.setdefault(info.part, info.part_hash) != info.part_hash:
            raise BadDataset(f"{path}: part {info.part!r} changed while it was collected; collect it again")
        outcomes[info.part].append(success)
    ratings = {}
    for name, pieces in sorted(outcomes.items()):
        n, n_success = sum(map(len, pieces)), int(sum(piece.sum() for piece in pieces))
        low, high = wilson_interval(n_success, n)
        ratings[name] = Rating(
            attempts=n,
            successes=n_success,
            interval=(float(low), float(high)),
            part_hash=hashes[name],
            dataset=str(folder),
        )
    return ratings


def estimate(parts: Sequence[Entry], rated: Sequence[Entry], low: float, high: float) -> np.ndarray:
    """Estimate the probability (n,) that the success rate of parts lies between two bounds.

    The share among the nearest rated parts in the logarithms of the three sorted edges, preferably of the
    same family, weighted by distance. A rated part is not its own neighbour, so that the estimate can be
    compared with the measurement.

    Raises:
        BadDataset: Fewer than two parts are rated.
    """
    if len(rated) < 2:
        raise BadDataset("fewer than two parts are rated; collect a dataset of the catalogue first")
    probability = np.empty(len(parts))
    edges = np.log([entry.extents for entry in rated])
    rates = np.array([entry.rating.rate if entry.rating else np.nan for entry in rated])
    inside = (rates >= low) & (rates <= high)
    for number, entry in enumerate(parts):
        distance = np.linalg.norm(edges - np.log(entry.extents), axis=1)
        distance += [0.0 if other.family == entry.family else _SAME_FAMILY for other in rated]
        distance[[other.name == entry.name for other in rated]] = np.inf
        nearest = np.argsort(distance, kind="stable")[:NEIGHBOURS]
        weight = 1 / (0.05 + distance[nearest])
        probability[number] = (weight * inside[nearest]).sum() / weight.sum()
    return probability


def passing(index: Index, low: float, high: float) -> tuple[int, float, float]:
    """Count the rated parts between the bounds, and estimate the number of all parts there.

    Returns:
        The number of rated parts inside, the expected number of all parts of the catalogue, and the standard
        error of the latter: the deviation of the estimate's error over the rated parts, scaled to the others.
    """
    rated = [entry for entry in index.parts.values() if entry.rating is not None]
    others = [entry for entry in index.parts.values() if entry.rating is None]
    inside = np.array([low <= entry.rating.rate <= high for entry in rated if entry.rating], dtype=float)
    expected = float(inside.sum())
    error = 0.0
    if others:
        residual = inside - estimate(rated, rated, low, high)
        expected += float(estimate(others, rated, low, high).sum()) + len(others) * float(residual.mean())
        error = len(others) * float(residual.std(ddof=1)) * np.sqrt(1 / len(rated) + 1 / len(others))
    return int(inside.sum()), expected, error


def draw_ratings(index: Index, bounds: tuple[float, float], path: Path) -> Path:
    """Draw the success rate of each part over its longest axis, and by family below."""
    rated = [entry for entry in index.parts.values() if entry.rating is not None]
    by_family: dict[str, list[float]] = defaultdict(list)
    for entry in rated:
        assert entry.rating is not None
        by_family[entry.family].append(entry.rating.rate)
    families = sorted(by_family, key=lambda family: float(np.mean(by_family[family])))
    columns = max(1, min(_MOST_COLUMNS, len(families) // 15))
    rows = -(-len(families) // columns)
    figure = Figure(figsize=(13, 4.5 + 0.15 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, columns, height_ratios=(4.0, 0.15 * rows))
    above = figure.add_subplot(grid[0, :])
    low, high = bounds
    above.axhspan(100 * low, 100 * high, color=PALE_GREEN, lw=0)
    for entry in rated:
        assert entry.rating is not None
        rate, interval = entry.rating.rate, entry.rating.interval
        colour = GREEN if low <= rate <= high else FAINT
        x = 1e3 * entry.longest_axis
        above.plot([x, x], [100 * end for end in interval], color=colour, lw=0.6, alpha=0.5)
        above.plot(x, 100 * rate, "o", ms=3.5, color=colour)
    above.set(xlabel="longest axis, mm", ylabel="random grasps that lift the part, %", ylim=(-2, 102))
    above.set_title(f"{len(rated)} rated parts, bars: 95 % intervals", loc="left", fontsize=11)
    above.spines[["top", "right"]].set_visible(False)
    for column in range(columns):
        # The families of lowest success are at the top of the first column.
        shown = families[column * rows : (column + 1) * rows]
        axes = figure.add_subplot(grid[1, column])
        axes.axvspan(100 * low, 100 * high, color=PALE_GREEN, lw=0)
        for row, family in enumerate(shown):
            for rate in by_family[family]:
                colour = GREEN if low <= rate <= high else FAINT
                axes.plot(100 * rate, row, "o", ms=3.5, color=colour, alpha=0.8)
        axes.set_yticks(range(len(shown)), [family.replace("_", " ") for family in shown], fontsize=6.5)
        axes.set(xlabel="success, %", xlim=(-3, 103), ylim=(rows - 0.5, -0.5))
        axes.spines[["top", "right"]].set_visible(False)
    write_figure(figure, path, dpi=130)
    return path
