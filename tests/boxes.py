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
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        return write_solid(
            Solid(mesh=mesh, hulls=(np.asarray(mesh.vertices),)),
            name=name,
            family="box",
            source="test",
            licence="Apache-2.0",
            density=mass / float(np.prod(size)),
            dimensions={},
            recipe_hash="test",
        )
