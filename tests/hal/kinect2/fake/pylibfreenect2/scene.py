"""Scene of the simulated Kinect: plates over a table, seen through the optics of the real camera.

Its infrared image and its depth share one lens, its colour camera hangs beside it (`to_colour`), all three
images are mirrored, and depth is measured too far by a constant.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

WIDTH, HEIGHT = 512, 424
COLOUR_WIDTH, COLOUR_HEIGHT = 1920, 1080
TABLE_M, BLOCK_M = 0.8, 0.75
BLOCK = (0.04, 0.10, -0.03, 0.02)
"""x_min, x_max, y_min, y_max of the block's top in the optical frame (x right, y down), metres."""
DEPTH_ERROR_MM = 24.0
"""Depth is measured too far by this much (libfreenect2's issue 144)."""
_INFRARED_RAYS, _COLOUR_RAYS = 4, 2
"""Rays along the edge of a pixel of a plate with a grey level or a texture."""
_INFRARED_WHITE = 20000.0

# A Kinect v2's factory calibration as libfreenect2 reports it (its issues and documentation quote this one).
INFRARED = dict(
    fx=365.456, fy=365.456, cx=254.878, cy=205.395, k1=0.0905474, k2=-0.26819, k3=0.0950862, p1=0.0, p2=0.0
)  # fmt: skip
COLOUR = dict(
    fx=1081.37, fy=1081.37, cx=959.5, cy=539.5, shift_d=863.0, shift_m=52.0,
    mx_x3y0=0.000449294, mx_x0y3=1.91656e-05, mx_x2y1=4.82909e-05, mx_x1y2=0.000353673,
    mx_x2y0=-2.44043e-05, mx_x0y2=-1.19426e-05, mx_x1y1=0.000988431, mx_x1y0=0.642474,
    mx_x0y1=0.00500649, mx_x0y0=0.142021,
    my_x3y0=4.42793e-06, my_x0y3=0.000724863, my_x2y1=0.000398557, my_x1y2=4.90383e-05,
    my_x2y0=0.000136024, my_x0y2=0.00107291, my_x1y1=-1.75465e-05, my_x1y0=-0.00554263,
    my_x0y1=0.641807, my_x0y0=0.0180811,
)  # fmt: skip
_POWERS = [(3, 0), (0, 3), (2, 1), (1, 2), (2, 0), (0, 2), (1, 1), (1, 0), (0, 1), (0, 0)]

Rays = tuple[np.ndarray, np.ndarray]
"""x / z and y / z in the optical frame, which is not mirrored."""


class Plate:
    """Flat rectangle in the optical frame; a later one in the list lies over an earlier one.

    Args:
        values: ``T``, (4, 4) pose, its face towards -z; ``size``, width and height in metres; ``grey``, its
            grey level, or ``texture``, a file of (h, w) uint8; without either it is in depth alone.
    """

    def __init__(self, values: dict[str, Any]):
        matrix = np.array(values["T"])
        self._turn, self._centre = matrix[:3, :3], matrix[:3, 3]
        self._half = np.array(values["size"]) / 2
        self.grey = np.load(values["texture"]) if "texture" in values else values.get("grey")
        normal = self._turn[:, 2]
        self._plane = normal / (normal @ self._centre)

    def corners(self) -> np.ndarray:
        """(4, 3) metres."""
        flat = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*self._half, 0]
        return flat @ self._turn.T + self._centre

    def inverse_depth(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """1 / z of the plate's plane along rays, 1/m."""
        return self._plane[0] * x + self._plane[1] * y + self._plane[2]

    def see(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whether rays hit the plate, at which z, and the grey level there."""
        z = 1 / self.inverse_depth(x, y)
        points = np.stack([x * z, y * z, z], axis=-1)
        where = (points - self._centre) @ self._turn[:, :2]
        hit = np.asarray((np.abs(where) <= self._half).all(axis=-1))
        if not isinstance(self.grey, np.ndarray):
            return hit, z, np.full(z.shape, float(self.grey or 0))
        h, w = self.grey.shape
        spot = ((where + self._half) / (2 * self._half) * [w, h]).astype(int)
        column, row = np.clip(spot[..., 0], 0, w - 1), np.clip(spot[..., 1], 0, h - 1)
        return hit, z, self.grey[row, column].astype(float)


BLOCK_PLATE = dict(
    T=[
        [1, 0, 0, (BLOCK[0] + BLOCK[1]) / 2],
        [0, 1, 0, (BLOCK[2] + BLOCK[3]) / 2],
        [0, 0, 1, BLOCK_M],
        [0, 0, 0, 1],
    ],
    size=[BLOCK[1] - BLOCK[0], BLOCK[3] - BLOCK[2]],
)


@functools.lru_cache(maxsize=4)
def plates(described: str) -> tuple[Plate, ...]:
    """The plates of a scene, described as JSON."""
    return tuple(Plate(values) for values in json.loads(described))


def _distort(x: np.ndarray, y: np.ndarray) -> Rays:
    r2 = x * x + y * y
    scale = 1 + ((INFRARED["k3"] * r2 + INFRARED["k2"]) * r2 + INFRARED["k1"]) * r2
    return x * scale, y * scale


def infrared_rays(columns: np.ndarray, rows: np.ndarray) -> Rays:
    """Rays of raw pixels of infrared and depth."""
    x_seen = (columns - INFRARED["cx"]) / INFRARED["fx"]
    y_seen = (rows - INFRARED["cy"]) / INFRARED["fy"]
    x, y = x_seen.copy(), y_seen.copy()
    for _ in range(25):  # inverse of the distortion by fixed point, to 1e-8 pixels
        x_now, y_now = _distort(x, y)
        x, y = x + x_seen - x_now, y + y_seen - y_now
    return -x, y  # the sensor's image is mirrored


def _infrared_pixels(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y = _distort(-points[:, 0] / points[:, 2], points[:, 1] / points[:, 2])
    return x * INFRARED["fx"] + INFRARED["cx"], y * INFRARED["fy"] + INFRARED["cy"]


def to_colour(x: np.ndarray, y: np.ndarray, inverse_depth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Column and row of the colour image in which a point appears (registration.cpp, not rounded)."""
    mx, my = -x * INFRARED["fx"] * 0.01, y * INFRARED["fy"] * 0.01
    xx, yy, xy = mx * mx, my * my, mx * my
    terms = (xx * mx, yy * my, xx * my, yy * mx, xx, yy, xy, mx, my, 1.0)
    wx, wy = np.zeros_like(x), np.zeros_like(x)
    for (i, j), term in zip(_POWERS, terms, strict=True):
        wx, wy = wx + COLOUR[f"mx_x{i}y{j}"] * term, wy + COLOUR[f"my_x{i}y{j}"] * term
    shift = COLOUR["shift_m"] * (inverse_depth / 1e3 - 1 / COLOUR["shift_d"])
    column = (wx / (COLOUR["fx"] * 0.002199) + shift) * COLOUR["fx"] + COLOUR["cx"]
    return column, wy / 0.002199 + COLOUR["cy"]


def colour_rays(plate: Plate, columns: np.ndarray, rows: np.ndarray) -> Rays:
    """Rays of the depth camera to the points of a plate's plane that colour pixels show."""
    focal = 0.642 * 0.01 / 0.002199 * INFRARED["fx"]  # colour pixels for a unit of x / z, roughly
    x, y = -(columns - COLOUR["cx"]) / focal, (rows - COLOUR["cy"]) / focal
    for _ in range(4):
        column, row = to_colour(x, y, plate.inverse_depth(x, y))
        x, y = x + (column - columns) / focal, y - (row - rows) / focal
    return x, y


def _paint(
    image: np.ndarray,
    plate: Plate,
    outline: tuple[np.ndarray, np.ndarray],
    rays: Callable[[np.ndarray, np.ndarray], Rays],
    brightness: Callable[[np.ndarray, np.ndarray], np.ndarray],
    n_rays: int,
) -> None:
    """Paint a plate with several rays for every pixel; what it covers in part is mixed."""
    h, w = image.shape[:2]
    left, right = (int(np.clip(f(outline[0]) + s, 0, w)) for f, s in ((np.min, -3), (np.max, 4)))
    top, bottom = (int(np.clip(f(outline[1]) + s, 0, h)) for f, s in ((np.min, -3), (np.max, 4)))
    if left >= right or top >= bottom:
        return
    within = (np.arange(n_rays) + 0.5) / n_rays - 0.5
    columns = (np.arange(left, right)[:, None] + within).reshape(-1)
    rows = (np.arange(top, bottom)[:, None] + within).reshape(-1)
    hit, z, grey = plate.see(*rays(*np.meshgrid(columns, rows)))
    shape = (bottom - top, n_rays, right - left, n_rays)
    share = hit.reshape(shape).mean(axis=(1, 3))
    light = (brightness(grey, z) * hit).reshape(shape).mean(axis=(1, 3))
    part = image[top:bottom, left:right]
    image[top:bottom, left:right] = part * (1 - share)[..., None] + light[..., None]


@functools.lru_cache(maxsize=4)
def true_depth(described: str) -> np.ndarray:
    """(424, 512) metres along the optical axis, raw: distorted and mirrored."""
    x, y = infrared_rays(*np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float)))
    depth = np.full((HEIGHT, WIDTH), TABLE_M)
    for plate in plates(described):
        hit, z, _ = plate.see(x, y)
        depth[hit] = z[hit]
    return depth


def raw_depth_mm(described: str, error_mm: float, noise_mm: float, number: int) -> np.ndarray:
    """(424, 512) float32 as measured, with every kind of invalid pixel in the corners.

    Args:
        described: Plates of the scene.
        error_mm: Added everywhere, millimetres.
        noise_mm: Standard deviation of every pixel, millimetres.
        number: Number of the frame; each has its own noise.
    """
    depth = true_depth(described) * 1e3 + error_mm
    if noise_mm:
        depth = depth + np.random.default_rng(number).normal(0, noise_mm, depth.shape)
    depth = depth.astype(np.float32)
    for corner, value in zip(
        (np.s_[:40, :40], np.s_[:40, -40:], np.s_[-40:, :40], np.s_[-40:, -40:]),
        (0.0, math.nan, math.inf, -1.0),
        strict=True,
    ):
        depth[corner] = value
    return depth


@functools.lru_cache(maxsize=4)
def raw_infrared(described: str) -> np.ndarray:
    """(424, 512) float32, 0 to 65535: lit by the camera itself, so that it fades with the distance."""
    table = _infrared_light(np.full((HEIGHT, WIDTH), 110.0), np.full((HEIGHT, WIDTH), TABLE_M))
    image = table[..., None]
    for plate in plates(described):
        if plate.grey is not None:
            outline = _infrared_pixels(plate.corners())
            _paint(image, plate, outline, infrared_rays, _infrared_light, _INFRARED_RAYS)
    return np.clip(image[..., 0], 0, 65535).astype(np.float32)


def _infrared_light(grey: np.ndarray, z: np.ndarray) -> np.ndarray:
    return grey / 255 * _INFRARED_WHITE * (TABLE_M / z) ** 2


@functools.lru_cache(maxsize=4)
def colour_bgrx(described: str) -> np.ndarray:
    """(1080, 1920, 4) uint8: blue tells the column, green the row, red is 200; plates are grey."""
    image = np.zeros((COLOUR_HEIGHT, COLOUR_WIDTH, 4), np.float32)
    image[..., 0] = np.arange(COLOUR_WIDTH)[None, :] // 8
    image[..., 1] = np.arange(COLOUR_HEIGHT)[:, None] // 5
    image[..., 2] = 200
    for plate in plates(described):
        if plate.grey is not None:
            corners = plate.corners()
            x, y = corners[:, 0] / corners[:, 2], corners[:, 1] / corners[:, 2]
            outline = to_colour(x, y, 1 / corners[:, 2])
            rays = functools.partial(colour_rays, plate)
            _paint(image, plate, outline, rays, lambda grey, _: grey, _COLOUR_RAYS)
    return np.rint(image).astype(np.uint8)


def undistortion(ir: SimpleNamespace) -> np.ndarray:
    """(424, 512) index of the raw pixel that shows each undistorted one, -1 outside (registration.cpp)."""
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    x, y = (columns - ir.cx) / ir.fx, (rows - ir.cy) / ir.fy
    r2 = x * x + y * y
    scale = 1 + ((ir.k3 * r2 + ir.k2) * r2 + ir.k1) * r2
    u = ir.fx * (x * scale + ir.p2 * (r2 + 2 * x * x) + 2 * ir.p1 * x * y) + ir.cx
    v = ir.fy * (y * scale + ir.p1 * (r2 + 2 * y * y) + 2 * ir.p2 * x * y) + ir.cy
    column, row = np.trunc(u + 0.5).astype(int), np.trunc(v + 0.5).astype(int)
    inside = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
    return np.where(inside, row * WIDTH + column, -1)


def colour_pixels(ir: SimpleNamespace, colour: SimpleNamespace, depth_mm: np.ndarray) -> np.ndarray:
    """(424, 512) index of the colour pixel that belongs to each depth pixel, -1 where none does."""
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    x, y = (columns - ir.cx) * 0.01, (rows - ir.cy) * 0.01
    powers = [(3, 0), (0, 3), (2, 1), (1, 2), (2, 0), (0, 2), (1, 1), (1, 0), (0, 1), (0, 0)]
    wx = sum(getattr(colour, f"mx_x{i}y{j}") * x**i * y**j for i, j in powers)
    wy = sum(getattr(colour, f"my_x{i}y{j}") * x**i * y**j for i, j in powers)
    column = wx / (colour.fx * 0.002199) - colour.shift_m / colour.shift_d
    row = np.trunc(wy / 0.002199 + colour.cy + 0.5)
    valid = np.isfinite(depth_mm) & (depth_mm > 0)
    shift = colour.shift_m / np.where(valid, depth_mm, 1.0)
    column = np.trunc((column + shift) * colour.fx + colour.cx + 0.5)
    index = column + row * 1920
    return np.where(valid & (index >= 0) & (index < 1920 * 1080), index, -1).astype(int)
