"""Error of the hand-eye calibration in the simulated cell, by the camera and the faults of its pictures.

Each cell is calibrated once; the faults are added to its pictures.

Run: python -m tests.benchmarks.calibration
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from hal.calibrate.board_views import Picture, picture_paths, read_picture
from hal.calibrate.config import CalibrateConfig
from hal.calibrate.hand_eye import solve_hand_eye
from hal.calibrate.report import depth_offset
from hal.calibrate.run import capture
from hal.charuco import Board
from mskgrasp.core.geometry import pose_distance
from mskgrasp.runtime.console_table import Table
from tests.benchmarks.report import show

CAMERAS = {
    "160 x 160 pixels, 0.8 m over the table": dict(n_pixels=160, height=0.8),
    "424 x 424 pixels, 1.0 m: a Kinect v2's registered colour without its outer columns": dict(
        n_pixels=424, height=1.0
    ),
}
DEPTH_OFFSET = 0.024
"""Of the camera's depth, metres: about a Kinect v2's."""
SIGMA = 2.0
"""Of the noise, grey levels."""
SHIFT = 0.2
"""Each pixel is taken up to this far off, pixels."""
BOARD = Board()


def exact(colour: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The picture (h, w, 3) as it is rendered."""
    return colour


def noisy(colour: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The picture with independent noise."""
    return np.clip(np.rint(colour + rng.normal(0, SIGMA, colour.shape)), 0, 255).astype(np.uint8)


def noisy_and_shifted(colour: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same, each pixel taken from beside its place."""
    rows, columns = np.indices(colour.shape[:2]).astype(np.float32)
    off = rng.uniform(-SHIFT, SHIFT, (2, *rows.shape)).astype(np.float32)
    taken = cv2.remap(
        colour, columns + off[0], rows + off[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return noisy(taken, rng)


FAULTS: dict[str, tuple[Callable[[np.ndarray, np.random.Generator], np.ndarray], int]] = {
    "as rendered": (exact, 1),
    f"noise of {SIGMA:g} grey levels": (noisy, 3),
    f"the same, each pixel taken up to {SHIFT:g} pixels off": (noisy_and_shifted, 3),
}
"""What is wrong with the pictures, and the number of seeds."""


def pictures_of(camera: dict[str, float], poses: int, folder: Path) -> list[Picture]:
    """Takes the pictures of one calibration; files are written into the folder."""
    cell = folder / "cell.yaml"
    noise = dict(model="kinect2", offset=DEPTH_OFFSET)
    cell.write_text(json.dumps(dict(type="sapien", camera=camera, noise=noise)), encoding="utf-8")
    capture(CalibrateConfig(cell=cell, out=folder, poses=poses, settle_s=0.1, speed=0.5), cell)
    return [read_picture(path) for path in picture_paths(folder)]


def rows_of(name: str, pictures: Sequence[Picture]) -> list[tuple[str, ...]]:
    """A row for each fault of the pictures: errors against the simulator's truth, and pictures used."""
    rows = []
    for fault, (spoil, seeds) in FAULTS.items():
        moved, turned, used, depths = [], [], [], []
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            seen = [dataclasses.replace(one, colour=spoil(one.colour, rng)) for one in pictures]
            found = solve_hand_eye(BOARD, [one.view(BOARD) for one in seen])
            apart, turn = pose_distance(pictures[0].T_base_camera, found.T_base_camera)
            offset = depth_offset(BOARD, seen, found)
            assert offset is not None
            moved.append(f"{1e3 * apart:.2f}")
            turned.append(f"{np.degrees(turn):.3f}")
            used.append(f"{len(found.used)}")
            depths.append(f"{1e3 * offset.metres:.1f}")
        columns = (_range(values) for values in (moved, turned, used, depths))
        rows.append((name, fault, str(seeds), *columns))
        name = ""
    return rows


def _range(values: Sequence[str]) -> str:
    low, high = min(values, key=float), max(values, key=float)
    return low if low == high else f"{low} - {high}"


def main() -> None:
    """Calibrates each camera and prints its errors."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--poses", type=int, default=24, help="pictures of a calibration")
    parser.add_argument("--out", type=Path, help="folder for report.json")
    given = parser.parse_args()
    rows = []
    for name, camera in CAMERAS.items():
        with tempfile.TemporaryDirectory() as folder:
            rows += rows_of(name, pictures_of(camera, given.poses, Path(folder)))
    header = ("camera", "pictures", "seeds", "error, mm", "degrees", "pictures used", "depth too far by, mm")
    show([Table(header=header, rows=rows)], given.out)


if __name__ == "__main__":
    main()
