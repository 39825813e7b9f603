"""Surfaces of known volume for tests of repairs, and their repair as a file's content."""

import numpy as np
import pytest
import trimesh

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.bodies import RepairedBodies, repair_bodies
from mskgrasp.parts.solids.surface import Surface


def box(*size: float, at=(0.0, 0.0, 0.0), inward: bool = False) -> Surface:
    mesh = trimesh.creation.box(size)
    faces = np.asarray(mesh.faces)[:, ::-1] if inward else np.asarray(mesh.faces)
    return Surface(vertices=np.asarray(mesh.vertices) + at, faces=faces)


def soup(*surfaces: Surface) -> Surface:
    """As an STL holds them: every face with corners of its own."""
    triangles = np.concatenate([surface.triangles for surface in surfaces])
    return Surface(vertices=triangles.reshape(-1, 3), faces=np.arange(3 * len(triangles)).reshape(-1, 3))


def grid(points: np.ndarray) -> Surface:
    """A closed surface of a grid (n, m, 3) that joins itself at all four borders."""
    n, m = points.shape[:2]
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Surface(vertices=points.reshape(-1, 3), faces=faces)


def torus(n: int = 200, m: int = 100, wide: float = 30.0, thick: float = 10.0) -> Surface:
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    radius = wide + thick * np.cos(v)
    return grid(np.stack([radius * np.cos(u), radius * np.sin(u), thick * np.sin(v)], axis=-1))


def one(*surfaces: Surface) -> RepairedBodies:
    return repair_bodies([soup(*surfaces)], bodies="one")


def refusal(*surfaces: Surface, bodies="one") -> str:
    with pytest.raises(BadPart) as caught:
        repair_bodies([soup(*surfaces)], bodies=bodies)
    assert "\n" not in str(caught.value)
    return str(caught.value)


TORUS_VOLUME = 2 * np.pi**2 * 30 * 10**2


def extruded(outline: np.ndarray, height: float) -> Surface:
    """A prism with any outline (n, 2), also one that crosses itself; its ends are fans about the origin."""
    n = len(outline)
    ends = [np.column_stack([np.vstack([outline, np.zeros(2)]), np.full(n + 1, z)]) for z in (0.0, height)]
    i = np.arange(n)
    j, centre, up = (i + 1) % n, np.full(n, n), n + 1
    faces = [(centre, j, i), (centre + up, i + up, j + up), (i, j, j + up), (i, j + up, i + up)]
    return Surface(
        vertices=np.concatenate(ends), faces=np.concatenate([np.stack(face, axis=1) for face in faces])
    )
