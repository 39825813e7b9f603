"""Height maps of a part before the grasp and after placing."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hal.camera import RgbdFrame
from mskgrasp.core.array_files import read_arrays, write_arrays
from mskgrasp.core.errors import BadDataset
from mskgrasp.perception.footprint import pixel_pitch, seen_points
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import Target

_N = 200


@dataclass(frozen=True, kw_only=True)
class HeightMaps:
    """Height maps of a part before the grasp and after placing: squares along the base's axes, metres.

    Attributes:
        before: (n, n) heights above the table before the grasp, centred on the part.
        after: (n, n) heights after placing, centred on the target; empty where the part was not placed.
        side: Edge length of both squares.
        top: Height of the part.
        grasp: (3,) x, y of the grasp relative to the part's centre, and theta.
        turn: Target turn of the part, radians.
        theta: Direction of its longer side at the target, radians.
    """

    before: np.ndarray
    after: np.ndarray
    side: float
    top: float
    grasp: np.ndarray
    turn: float
    theta: float


def take_height_maps(
    before: RgbdFrame, after: RgbdFrame | None, plan: GraspPlan, target: Target, theta: float
) -> HeightMaps:
    """Compute the height maps of a placement from its frames."""
    view = plan.view
    side = max(0.1, 1.6 * float(np.hypot(*view.size[:2])))
    return HeightMaps(
        before=_heights(before, view.centre_base[:2], side, view.table_z),
        after=np.empty((0, 0))
        if after is None
        else _heights(after, np.array([target.x, target.y]), side, view.table_z),
        side=side,
        top=float(view.size[2]),
        grasp=np.array([*(plan.grasp.position[:2] - view.centre_base[:2]), plan.grasp.theta]),
        turn=target.theta,
        theta=theta,
    )


def write_height_maps(maps: HeightMaps, path: Path) -> None:
    """Write height maps as a compressed file, atomically."""
    values: dict[str, Any] = {name: np.asarray(value) for name, value in asdict(maps).items()}
    for name in ("before", "after"):
        values[name] = values[name].astype(np.float32)
    write_arrays(path, **values)


def read_height_maps(path: Path) -> HeightMaps:
    """Read a file of `write_height_maps`.

    Raises:
        BadDataset: The file is missing or damaged.
    """
    try:
        values = read_arrays(path)
        numbers = {name: float(values[name]) for name in ("side", "top", "turn", "theta")}
        return HeightMaps(
            before=values["before"], after=values["after"], grasp=values["grasp"].reshape(3), **numbers
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise BadDataset(f"{path} is missing or damaged; start again in another --out") from error


def _heights(frame: RgbdFrame, centre: np.ndarray, side: float, table_z: float) -> np.ndarray:
    """Orthographic heights (n, n) above the table, free of parallax."""
    points = seen_points(frame)
    cell = side / _N
    from_corner = (points[:, :2] - centre) * [1, -1] + side / 2
    inside = ((from_corner >= 0) & (from_corner < side)).all(axis=1)
    columns, rows = np.floor(from_corner[inside] / cell).astype(int).T
    heights = np.zeros((_N, _N), dtype=np.float32)
    np.maximum.at(heights, (rows, columns), (points[inside, 2] - table_z).astype(np.float32))
    # A camera pixel covers several cells around its point.
    width = 2 * round(pixel_pitch(frame) / cell / 2) + 1
    return cv2.dilate(heights, cv2.getStructuringElement(cv2.MORPH_RECT, (width, width)))
