"""The rectangle that a part fills on the table: seen in a depth image, or known from its CAD file."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch
import trimesh

from hal.camera import RgbdFrame
from mskgrasp.geometry import quat_rotate, wrap_half_turn
from mskgrasp.grasp import PartView
from mskgrasp.images import crop_patches, height_image
from mskgrasp.parts import Part

_PIXEL = 0.0005
_LEVEL = 0.3
"""Share of the part's height over which a pixel belongs to it: half a pixel of slope counts half."""


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """The smallest rectangle around a part seen from above.

    Attributes:
        sides: (2,) the longer and the shorter one, metres.
        theta: Direction of the longer side from base x, radians in [-pi/2, pi/2).
    """

    sides: np.ndarray
    theta: float

    def extent(self, theta: float) -> np.ndarray:
        """(2,) how far it reaches along base x and y with the longer side at ``theta``, metres."""
        cos, sin = abs(np.cos(theta)), abs(np.sin(theta))
        long, short = self.sides
        return np.array([cos * long + sin * short, sin * long + cos * short])


def footprint_of(points: np.ndarray) -> Footprint:
    """The footprint of points (n, 2), base frame, metres."""
    # OpenCV's rectangle is exact for points of some size, not for metres in single precision.
    _, (width, height), angle = cv2.minAreaRect((np.asarray(points) * 1e3).astype(np.float32))
    long, short = max(width, height), min(width, height)
    theta = np.radians(angle + (0.0 if width >= height else 90.0))
    return Footprint(sides=np.array([long, short]) * 1e-3, theta=float(wrap_half_turn(np.asarray(theta))))


def seen_footprint(frame: RgbdFrame, view: PartView) -> Footprint:
    """The footprint of the part that a frame shows.

    Args:
        frame: Of the part on the table.
        view: Where the part was found in it.
    """
    side = 1.3 * float(np.hypot(*view.size[:2])) + 0.02
    n = int(np.ceil(side / _PIXEL))
    # In the plane of the part's top there is no parallax.
    square = torch.tensor([[*view.centre_base[:2], view.table_z + view.size[2], 0.0]])
    heights = height_image(torch.from_numpy(frame.depth), frame.intrinsics, frame.T_base_camera, view.table_z)
    patch = crop_patches(heights, square, frame.intrinsics, frame.T_base_camera, n_pixels=n, side=side)
    high = (patch[0, 0].numpy() > _LEVEL * view.size[2]).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(high, connectivity=8)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    rows, columns = np.nonzero(labels == largest)
    middle, pitch = (n - 1) / 2, side / n
    return footprint_of(np.column_stack([columns - middle, middle - rows]) * pitch)


def usual_footprint(part: Part) -> Footprint:
    """The footprint of a part on the side on which it comes to lie most often; theta is 0."""
    mesh = trimesh.load_mesh(part.mesh_path)
    quat_wxyz = part.resting.quat_wxyz[int(np.argmax(part.resting_probability))]
    found = footprint_of(quat_rotate(quat_wxyz, np.asarray(mesh.vertices))[:, :2])
    return Footprint(sides=found.sides, theta=0.0)
