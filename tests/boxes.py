"""Real part folders of plain boxes, whose behaviour in a hand can be worked out on paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mskgrasp.parts import Part
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.write_solid import write_solid


def make_box(cache: Path, name: str, size: tuple[float, float, float], mass: float) -> Part:
    """A box of `size` metres and `mass` kg, as a part folder under ``cache``."""
    mesh = trimesh.creation.box(np.array(size) * 1000)
    solid = Solid(mesh=mesh, hulls=(np.asarray(mesh.vertices),))
    return _write(cache, name, solid, mass / float(np.prod(size)))


def make_rail(cache: Path, name: str, *, length: float, flange: float, web: float, density: float) -> Part:
    """A rail of I profile, 37 mm high with flanges of 6 and 5 mm; metres and kg/m^3, as `make_box` does."""
    boxes = []
    for width, height, middle in ((flange, 6.0, 3.0), (web, 26.0, 19.0), (flange, 5.0, 34.5)):
        box = trimesh.creation.box([1e3 * length, 1e3 * width, height])
        boxes.append(box.apply_translation([0.0, 0.0, middle]))
    hulls = tuple(np.asarray(box.vertices) for box in boxes)
    return _write(cache, name, Solid(mesh=trimesh.boolean.union(boxes), hulls=hulls), density)


def make_u(cache: Path, name: str) -> tuple[Part, np.ndarray]:
    """A U of two legs of 60 mm and, 100 mm away, 30 mm, which reaches to the middle of the near one.

    Returns:
        The part, and the middle (3,) of the near leg in its frame, metres.
    """
    boxes = []
    near = np.array([0.0, 50.0, 10.0])
    for size, middle in (
        ((60.0, 10.0, 20.0), near),
        ((10.0, 110.0, 6.0), (25.0, 0.0, 3.0)),
        ((30.0, 10.0, 20.0), (15.0, -50.0, 10.0)),
    ):
        boxes.append(trimesh.creation.box(size).apply_translation(middle))
    mesh = trimesh.boolean.union(boxes)
    part = _write(cache, name, Solid(mesh=mesh, hulls=tuple(np.asarray(box.vertices) for box in boxes)), 2700)
    return part, 1e-3 * (near - mesh.center_mass)


def _write(cache: Path, name: str, solid: Solid, density: float) -> Part:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        return write_solid(
            solid,
            name=name,
            family="box",
            source="test",
            licence="Apache-2.0",
            density=density,
            dimensions={},
            recipe_hash="test",
        )
