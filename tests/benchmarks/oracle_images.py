"""Images that no camera sees: a part's exact heights, its underside, and its sides as the pads meet them.

They are rendered from points on the part's mesh at its true pose, without perspective, in the frame of a
patch: rows along the closing direction (y, the first row at its largest), columns along x.
"""

from __future__ import annotations

import hashlib
import io
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch
import trimesh
from torch import Tensor

from mskgrasp.core.files import write_whole
from mskgrasp.core.geometry import Pose
from mskgrasp.core.grasp import MAX_OPENING, PAD_REACH
from mskgrasp.learning.network_config import HandNetworkConfig
from mskgrasp.learning.samples import HEIGHT_STEP, Samples
from mskgrasp.parts import load_part
from mskgrasp.runtime.progress import progress
from tests.benchmarks.known_parts import poses

POINTS_PER_MM2 = 6.0
"""Density of points on the mesh: of pixels of 1 mm, 0.3 % get none."""
_MOST_POINTS = 300_000
PAD_ROW = 0.001
"""Height of a row of the sides' image, metres."""
KINDS = ("heights", "underside", "sides")


def mesh_points(mesh: trimesh.Trimesh) -> np.ndarray:
    """Points (m, 3) spread over a mesh's surface, in its frame; the same every time."""
    n = int(np.clip(mesh.area * 1e6 * POINTS_PER_MM2, 1000, _MOST_POINTS))
    return np.asarray(trimesh.sample.sample_surface(mesh, n, seed=0)[0], dtype=np.float32)


def heights(points: np.ndarray, grasp_height: float, shape: tuple[int, int], pixel: float) -> np.ndarray:
    """Heights above the table seen from straight above.

    Args:
        points: (m, 3) of the part in the grasp frame, metres.
        grasp_height: Height of the grasp above the table, metres.
        shape: Rows and columns.
        pixel: Distance of pixels, metres.

    Returns:
        ``shape``, metres, 0 where there is no part.
    """
    found = _seen(points, points[:, 2] + grasp_height, shape, pixel)
    return np.where(np.isfinite(found), found, 0.0)


def underside(points: np.ndarray, grasp_height: float, shape: tuple[int, int], pixel: float) -> np.ndarray:
    """Heights above the table seen from straight below, as `heights`."""
    found = -_seen(points, -(points[:, 2] + grasp_height), shape, pixel)
    return np.where(np.isfinite(found), found, 0.0)


def sides(points: np.ndarray, shape: tuple[int, int], pixel: float) -> np.ndarray:
    """How far out a part's surface lies on the side of each pad.

    The upper half of the rows is the side of the pad at +y, the lower half the other's. From the middle
    outwards rows rise from the pads' lower edge, `PAD_ROW` each; columns are those of a patch. So mirroring
    or turning the hand flips the image.

    Args:
        points: (m, 3) of the part in the grasp frame, metres.
        shape: Rows and columns.
        pixel: Distance of columns, metres.

    Returns:
        ``shape``, metres from the middle of the hand to the outermost surface between the open pads, minus
        half the opening where there is none.
    """
    half = shape[0] // 2
    between = points[np.abs(points[:, 1]) < MAX_OPENING / 2]
    row = np.floor((between[:, 2] + PAD_REACH) / PAD_ROW).astype(np.int64)
    column = _column(between[:, 0], shape[1], pixel)
    inside = (row >= 0) & (row < half) & (column >= 0) & (column < shape[1])
    between, row, column = between[inside], row[inside], column[inside]
    found = np.full(shape, -MAX_OPENING / 2, dtype=np.float32)
    middle = (shape[0] - 1) / 2
    above, below = int(np.ceil(middle)) - 1, int(np.floor(middle)) + 1
    np.maximum.at(found, (above - row, column), between[:, 1])
    np.maximum.at(found, (below + row, column), -between[:, 1])
    return found


def _column(x: np.ndarray, n: int, pixel: float) -> np.ndarray:
    return np.rint(x / pixel + (n - 1) / 2).astype(np.int64)


def _seen(points: np.ndarray, values: np.ndarray, shape: tuple[int, int], pixel: float) -> np.ndarray:
    """Largest value in each pixel; without points the mean of 5 neighbours or more that have any, or -inf."""
    rows, columns = shape
    row = np.rint((rows - 1) / 2 - points[:, 1] / pixel).astype(np.int64)
    column = _column(points[:, 0], columns, pixel)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = np.full((rows + 2, columns + 2), -np.inf, dtype=np.float32)
    np.maximum.at(found, (row[inside] + 1, column[inside] + 1), values[inside].astype(np.float32))
    around = np.stack(
        [
            found[1 + i : 1 + i + rows, 1 + j : 1 + j + columns]
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if (i, j) != (0, 0)
        ]
    )
    known = np.isfinite(around)
    mean = np.where(known, around, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    here = found[1:-1, 1:-1]
    return np.where(~np.isfinite(here) & (known.sum(axis=0) >= 5), mean, here)


@lru_cache(maxsize=2)
def _part_points(name: str) -> np.ndarray:
    mesh = trimesh.load_mesh(load_part(name).mesh_path)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh_points(mesh)


def images(samples: Samples, kind: str, network: HandNetworkConfig, cache: Path) -> Tensor:
    """One image of every successful attempt, and zeros of the others; kept on disk.

    Args:
        samples: The dataset.
        kind: One of `KINDS`.
        network: Gives shape and resolution.
        cache: Folder.

    Returns:
        (n, r, c) int16, 0.1 mm.
    """
    rows = torch.nonzero(samples.success)[:, 0]
    pose = poses(samples, rows)
    key = hashlib.sha256(np.ascontiguousarray(pose).tobytes())
    key.update(f"{kind} {network.patch_shape} {network.pixel:.6f} {POINTS_PER_MM2}".encode())
    path = cache / f"{kind}-{key.hexdigest()[:16]}.npy"
    if not path.exists():
        cache.mkdir(parents=True, exist_ok=True)
        _write(path, _rendered(samples, rows, Pose.from_vector(pose), kind, network))
    found = torch.zeros((len(samples), *network.patch_shape), dtype=torch.int16)
    found[rows] = torch.from_numpy(np.load(path, allow_pickle=False))
    return found


def _write(path: Path, values: np.ndarray) -> None:
    content = io.BytesIO()
    np.save(content, values)
    write_whole(path, content.getvalue())


def _rendered(
    samples: Samples, rows: Tensor, T_grasp_obj: Pose, kind: str, network: HandNetworkConfig
) -> np.ndarray:
    shape, pixel = network.patch_shape, network.pixel
    found = np.empty((len(rows), *shape), dtype=np.int16)
    for place, row in enumerate(progress(rows.tolist(), unit="image", title=kind)):
        here = Pose(
            position=T_grasp_obj.position[place].astype(np.float32),
            quat_wxyz=T_grasp_obj.quat_wxyz[place].astype(np.float32),
        ).apply(_part_points(samples.parts[int(samples.part[row])]))
        height = float(samples.height[row])
        if kind == "sides":
            image = sides(here, shape, pixel)
        else:
            image = (heights if kind == "heights" else underside)(here, height, shape, pixel)
        found[place] = np.rint(image / HEIGHT_STEP)
    return found
