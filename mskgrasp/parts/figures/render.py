"""Software renderer for pictures of parts: orthographic, z-buffered, no GPU.

Our own renderer, 0.5 to 1.3 s a picture: matplotlib's Poly3DCollection (0.05 s) sorts triangles, not
pixels, and draws a bracket's far wall over its near one; PyVista (0.2 s) draws as well, but adds 580 MB of
packages.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.ndimage import gaussian_filter

SUPERSAMPLING = 2
_LIGHT = np.array([-0.35, -0.45, 0.82])  # direction towards the main light, world axes
_FILL = np.array([0.8, 0.2, 0.25])
_TABLE = np.array([0.93, 0.925, 0.915])


@dataclass(frozen=True, kw_only=True)
class Body:
    """A mesh with one colour, world coordinates in any unit."""

    mesh: trimesh.Trimesh
    colour: tuple[float, float, float]


def render(
    bodies: Sequence[Body],
    *,
    width: int,
    height: int,
    table: bool,
    azimuth: float = -60,
    elevation: float = 32,
) -> np.ndarray:
    """A picture (height, width, 3) in 0..1 of bodies seen from outside, filling the frame, white behind.

    Args:
        bodies: Bodies to draw.
        width: Pixels.
        height: Pixels.
        table: Whether to draw a table at z = 0, fading out, with the bodies' shadow.
        azimuth: Direction of the viewer about z, degrees.
        elevation: Elevation of the viewer above the table, degrees.
    """
    w, h = width * SUPERSAMPLING, height * SUPERSAMPLING
    view = _view(np.radians(azimuth), np.radians(elevation))
    points = np.concatenate([body.mesh.vertices for body in bodies]) @ view.T
    low, high = points.min(axis=0), points.max(axis=0)
    fill = 0.66 if table else 0.86
    scale = fill * min(w / (high[0] - low[0]), h / (high[1] - low[1]))
    middle = (low + high) / 2
    offset = np.array([w / 2, h / 2, 0.0]) - scale * np.array([middle[0], -middle[1], 0.0])

    depth = np.full((h, w), -np.inf)
    normal = np.zeros((h, w, 3))
    owner = np.full((h, w), -1)
    for number, body in enumerate(bodies):
        smooth = trimesh.graph.smooth_shade(body.mesh, angle=np.radians(25))
        seen = (np.asarray(smooth.vertices) @ view.T) * [scale, -scale, scale] + offset
        _draw(
            seen[smooth.faces], np.asarray(smooth.vertex_normals)[smooth.faces], number, depth, normal, owner
        )

    image = np.ones((h, w, 3))
    if table:
        image = _table(bodies, view, scale, offset, (h, w))
    drawn = owner >= 0
    colours = np.array([body.colour for body in bodies])
    image[drawn] = _shade(normal[drawn], colours[owner[drawn]], view)
    image *= (1 - 0.72 * _outlines(depth, normal, owner, scale * float(np.ptp(points, axis=0).max())))[
        ..., None
    ]
    return image.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3).mean(axis=(1, 3)).clip(0, 1)


def _view(azimuth: float, elevation: float) -> np.ndarray:
    """Rotation (3, 3) into x right, y up, z towards the viewer."""
    towards = np.array(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def _draw(
    triangles: np.ndarray,
    normals: np.ndarray,
    number: int,
    depth: np.ndarray,
    normal: np.ndarray,
    owner: np.ndarray,
) -> None:
    """Draw triangles (n, 3, 3) given in pixels and depth into the buffers."""
    h, w = depth.shape
    for (a, b, c), corner_normals in zip(triangles, normals, strict=True):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= -1e-9:  # turned away; image rows run down, so front faces turn clockwise
            continue
        x0, x1 = max(int(min(a[0], b[0], c[0])), 0), min(int(max(a[0], b[0], c[0])) + 2, w)
        y0, y1 = max(int(min(a[1], b[1], c[1])), 0), min(int(max(a[1], b[1], c[1])) + 2, h)
        x, y = np.arange(x0, x1) + 0.5, (np.arange(y0, y1) + 0.5)[:, None]
        u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
        v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
        t = 1 - u - v
        z = u * a[2] + v * b[2] + t * c[2]
        window = (slice(y0, y1), slice(x0, x1))
        wins = (u >= -1e-9) & (v >= -1e-9) & (t >= -1e-9) & (z > depth[window])
        if wins.any():
            depth[window][wins] = z[wins]
            weights = np.stack([u[wins], v[wins], t[wins]], axis=1)
            normal[window][wins] = weights @ corner_normals
            owner[window][wins] = number


def _shade(normals: np.ndarray, colours: np.ndarray, view: np.ndarray) -> np.ndarray:
    unit = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    light, fill = _LIGHT / np.linalg.norm(_LIGHT), _FILL / np.linalg.norm(_FILL)
    half = light + view[2]
    half /= np.linalg.norm(half)
    diffuse = 0.50 + 0.44 * np.maximum(unit @ light, 0) + 0.18 * np.maximum(unit @ fill, 0)
    gloss = 0.22 * np.maximum(unit @ half, 0) ** 24
    return colours * diffuse[:, None] + gloss[:, None]


def _outlines(depth: np.ndarray, normal: np.ndarray, owner: np.ndarray, size: float) -> np.ndarray:
    """1 where a body ends or occludes another, 0.55 at sharp folds, 0 elsewhere."""
    edge = np.zeros(depth.shape)
    solid = np.where(np.isfinite(depth), depth, -1e6)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-9)
    for axis in (0, 1):
        here = [slice(None), slice(None)]
        there = [slice(None), slice(None)]
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        i, j = tuple(here), tuple(there)
        jump = (np.abs(solid[i] - solid[j]) > 0.03 * size) | (owner[i] != owner[j])
        both = (owner[i] >= 0) & (owner[j] >= 0)
        fold = both & ((unit[i] * unit[j]).sum(axis=2) < np.cos(np.radians(24)))
        edge[i] = np.maximum(edge[i], np.where(jump, 1.0, np.where(fold, 0.55, 0.0)))
    return edge


def _table(
    bodies: Sequence[Body], view: np.ndarray, scale: float, offset: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    """Picture of the table: a disc that fades into white, with a soft shadow."""
    h, w = shape
    cells = 256
    points = np.concatenate([body.mesh.vertices for body in bodies])
    reach = 1.6 * float(np.abs(points).max()) + 1e-9
    shadow = np.zeros((cells, cells))
    light = _LIGHT / _LIGHT[2]
    for body in bodies:
        flat = np.asarray(body.mesh.vertices) - np.asarray(body.mesh.vertices)[:, 2:] * light
        corners = np.concatenate([(flat[:, :2] / reach + 1) * cells / 2, np.zeros((len(flat), 1))], axis=1)
        buffers = np.full((cells, cells), -np.inf), np.zeros((cells, cells, 3)), np.full((cells, cells), -1)
        for faces in (body.mesh.faces, body.mesh.faces[:, ::-1]):
            _draw(corners[faces], np.zeros((len(faces), 3, 3)), 0, *buffers)
        shadow = np.maximum(shadow, buffers[2] >= 0)
    shadow = 0.6 * gaussian_filter(shadow, 2.0) + 0.4 * gaussian_filter(shadow, 7.0)

    columns, rows = np.meshgrid(np.arange(w) + 0.5, np.arange(h) + 0.5)
    right, up = (columns - offset[0]) / scale, -(rows - offset[1]) / scale
    # The point of the table under a pixel: right and up fix two coordinates, z = 0 the third.
    ground = np.linalg.inv(np.stack([view[0], view[1], [0, 0, 1]])) @ np.stack(
        [right.ravel(), up.ravel(), np.zeros(right.size)]
    )
    x, y = ground[0].reshape(shape), ground[1].reshape(shape)
    column = ((x / reach + 1) * cells / 2).astype(int).clip(0, cells - 1)
    row = ((y / reach + 1) * cells / 2).astype(int).clip(0, cells - 1)
    inside = (np.abs(x) < reach) & (np.abs(y) < reach)
    dark = np.where(inside, shadow[row, column], 0.0)
    # The table fades with distance from the centre, so that no tile has a visible frame.
    far = np.hypot((columns - w / 2) / (w / 2), (rows - h / 2) / (h / 2))
    fade = np.clip((1.0 - far) / 0.35, 0, 1)[..., None]
    table = _TABLE * (1 - 0.45 * dark[..., None])
    return fade * table + (1 - fade)
