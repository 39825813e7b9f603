"""Finds the parts of a dataset's images through noise: how far from where they are seen without it."""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest.mock import patch

import numpy as np

from hal.sensor_noise import NoiseModel, SensorNoise, add_noise
from mskgrasp.core.errors import NoPartFound
from mskgrasp.core.grasp import PartView
from mskgrasp.dataset import ShardInfo, list_shards, u16_to_depth
from mskgrasp.dataset.shards import read_columns
from mskgrasp.perception import depth_noise
from mskgrasp.perception import part_detection as finding
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.report import show

NARROW = 0.008
"""Parts of which a side is less are reported separately, metres."""


def main() -> None:
    """Prints a row a noise and method."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, required=True, help="dataset folder")
    parser.add_argument("--images", type=int, default=450)
    parser.add_argument("--out", type=Path, help="folder for report.json")
    options = parser.parse_args()
    paths = list_shards(options.data)
    rng = np.random.default_rng(0)
    images = []
    for index in rng.permutation(len(paths))[: options.images // 3]:
        arrays, info = read_columns(paths[index], ["depth"])
        rows = np.linspace(0, len(arrays["depth"]) - 1, 3).astype(int)
        images += [(u16_to_depth(arrays["depth"][row]), info) for row in rows]
    exact = [view(depth, info, 0.002) for depth, info in images]
    narrow = np.array([one is not None and one.size.min() < NARROW for one in exact])
    rows = []
    models: tuple[NoiseModel, ...] = ("iid", "kinect2")
    for model in models:
        noisy = [
            add_noise(depth, info.intrinsics, SensorNoise(model=model), np.random.default_rng(k))
            for k, (depth, info) in enumerate(images)
        ]
        for method, quiet, height in (
            ("a pixel by itself", np.inf, 0.006),
            ("ours", depth_noise.QUIET, 0.003),
        ):
            with patch.object(depth_noise, "QUIET", quiet):
                seen = [view(d, info, height) for d, (_, info) in zip(noisy, images, strict=True)]
            for kind, chosen in (("narrow", narrow), ("other", ~narrow)):
                rows.append((model, method, kind, *errors(seen, exact, chosen)))
    header = ("noise", "method", "parts", "not found", "centre mm", "90 %", "size mm", "90 %", "top mm")
    show([Table(header=header, rows=rows)], options.out)


def view(depth: np.ndarray, info: ShardInfo, min_height: float) -> PartView | None:
    """Where the part is seen; None where it is not, or not as one."""
    try:
        return finding.view_part(
            depth, info.intrinsics, info.T_base_camera,
            table_z=info.table_z, region=info.region, min_height=min_height, alone=True,
        )  # fmt: skip
    except NoPartFound:
        return None


def errors(seen: list[PartView | None], exact: list[PartView | None], chosen: np.ndarray) -> list[str]:
    """Those not found, and medians and 90th percentiles of the others, for the table."""
    pairs = [(a, b) for a, b, c in zip(seen, exact, chosen, strict=True) if c and b is not None]
    found = [(a, b) for a, b in pairs if a is not None]
    off = 1e3 * np.array([a.centre_base - b.centre_base for a, b in found]).reshape(-1, 3)
    size = 1e3 * np.array([a.size - b.size for a, b in found]).reshape(-1, 3)
    values = (np.hypot(off[:, 0], off[:, 1]), np.abs(size[:, :2]).mean(axis=1), size[:, 2])
    if not found:
        return [f"{len(pairs)} of {len(pairs)}", *5 * [""]]
    shown = [np.percentile(v, share) for v in values[:2] for share in (50, 90)] + [np.median(values[2])]
    return [f"{len(pairs) - len(found)} of {len(pairs)}", *(f"{v:.1f}" for v in shown)]


if __name__ == "__main__":
    main()
