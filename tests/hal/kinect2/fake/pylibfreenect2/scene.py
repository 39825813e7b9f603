"""Scene of the simulated Kinect: a table, a block on it, and the camera's own distortion and mirror."""

from __future__ import annotations

import functools
import math
from types import SimpleNamespace

import numpy as np

WIDTH, HEIGHT = 512, 424
TABLE_M, BLOCK_M = 0.8, 0.75
BLOCK = (0.04, 0.10, -0.03, 0.02)
"""x_min, x_max, y_min, y_max of the block's top in the optical frame (x right, y down), metres."""

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


def _distort(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r2 = x * x + y * y
    scale = 1 + ((INFRARED["k3"] * r2 + INFRARED["k2"]) * r2 + INFRARED["k1"]) * r2
    return x * scale, y * scale


def _grid() -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    return (columns - INFRARED["cx"]) / INFRARED["fx"], (rows - INFRARED["cy"]) / INFRARED["fy"]


@functools.cache
def raw_depth_mm() -> np.ndarray:
    """(424, 512) float32: distorted, mirrored, with every kind of invalid pixel in the corners."""
    x_seen, y_seen = _grid()
    x, y = x_seen.copy(), y_seen.copy()
    for _ in range(50):  # inverse of the distortion by fixed point
        x_now, y_now = _distort(x, y)
        x, y = x + x_seen - x_now, y + y_seen - y_now
    x = -x  # the sensor's image is mirrored
    left, right, top, bottom = (value / BLOCK_M for value in BLOCK)
    block = (x > left) & (x < right) & (y > top) & (y < bottom)
    depth = np.where(block, BLOCK_M, TABLE_M).astype(np.float32) * np.float32(1e3)
    for corner, value in zip(
        (np.s_[:40, :40], np.s_[:40, -40:], np.s_[-40:, :40], np.s_[-40:, -40:]),
        (0.0, math.nan, math.inf, -1.0),
        strict=True,
    ):
        depth[corner] = value
    return depth


@functools.cache
def colour_bgrx() -> np.ndarray:
    """(1080, 1920, 4) uint8: blue tells the column, green the row, red is 200."""
    image = np.zeros((1080, 1920, 4), np.uint8)
    image[..., 0] = np.arange(1920)[None, :] // 8
    image[..., 1] = np.arange(1080)[:, None] // 5
    image[..., 2] = 200
    return image


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
