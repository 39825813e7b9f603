"""Measures on shapes of recipes that tests of drive elements share; millimetres."""

import math
from functools import cache

import numpy as np

from mskgrasp.parts.recipes.families import recipes
from mskgrasp.parts.solids.solid import Solid


@cache
def made(name: str) -> Solid:
    """The shape of a built-in part; tests must not change it."""
    recipe = recipes()[name]
    return recipe.make(recipe.dimensions)


def family(name: str) -> list[str]:
    """Names of a family's parts."""
    return [recipe.name for recipe in recipes().values() if recipe.family == name]


def extents(solid: Solid) -> list[float]:
    """Sizes along x, y and z."""
    return [float(size) for size in np.ptp(np.asarray(solid.mesh.vertices), axis=0)]


def radii(solid: Solid) -> np.ndarray:
    """Distances of the mesh's corners from the z axis."""
    points = np.asarray(solid.mesh.vertices)
    return np.hypot(points[:, 0], points[:, 1])


def cylinder(diameter: float, length: float) -> float:
    """Volume."""
    return math.pi / 4 * diameter**2 * length


def tips(solid: Solid, tip_radius: float, z: tuple[float, float], number: int) -> int:
    """How many teeth reach the tip circle between two heights, for about ``number`` teeth."""
    points = np.asarray(solid.mesh.vertices)
    near = (np.hypot(points[:, 0], points[:, 1]) > 0.999 * tip_radius) & (points[:, 2] > z[0])
    angles = np.sort(np.arctan2(points[near, 1], points[near, 0])[points[near, 2] < z[1]])
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    return int(np.count_nonzero(gaps > 0.4 * 2 * np.pi / number))


_TRIANGLES: dict[int, np.ndarray] = {}


def is_inside(solid: Solid, x: float, y: float, z: float) -> bool:
    """Whether a point lies in the mesh: a ray along a skew direction leaves it an odd number of times."""
    direction = np.array([0.3137, 0.5411, 0.7802])
    if id(solid) not in _TRIANGLES:
        _TRIANGLES[id(solid)] = np.asarray(solid.mesh.vertices)[np.asarray(solid.mesh.faces)]
    triangles = _TRIANGLES[id(solid)]
    triangles = triangles[triangles[:, :, 2].max(axis=1) > z] - [x, y, z]
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    signs = [np.sign(np.cross(p, q) @ direction) for p, q in ((a, b), (b, c), (c, a))]
    hit = (signs[0] == signs[1]) & (signs[1] == signs[2])
    normal = np.cross(b - a, c - a)[hit]
    ahead = np.einsum("ij,ij->i", normal, a[hit]) / (normal @ direction) > 0
    return bool(np.count_nonzero(ahead) % 2)
