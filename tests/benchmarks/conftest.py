"""A small dataset of grasps at stored parts of an own catalogue."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from mskgrasp.dataset import shard_path, write_shard
from mskgrasp.parts.catalogue import Index, entry_of, make_index, split_of, write_index
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.write_solid import write_solid
from tests import synthetic

SIDES = ("train",) * 5 + ("validation",) * 2 + ("test",)
ATTEMPTS = 48


@dataclass(frozen=True, kw_only=True)
class Boxes:
    """Dataset folder, folder of the cache with its parts, and the sizes of the boxes in metres by name."""

    data: Path
    cache: Path
    sizes: dict[str, tuple[float, float, float]]


@pytest.fixture(scope="session")
def stored_boxes(tmp_path_factory: pytest.TempPathFactory) -> Boxes:
    """Grasps at eight boxes, which are stored parts on known sides of the catalogue; not to be changed."""
    rng = np.random.default_rng(1)
    folder = tmp_path_factory.mktemp("boxes")
    sizes = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        for number, side in enumerate(SIDES):
            name = f"box_{number}"
            sizes[name] = (float(rng.uniform(0.04, 0.09)), float(rng.uniform(0.02, 0.035)), 0.03)
            mesh = trimesh.creation.box([1e3 * edge for edge in sizes[name]])
            families = (f"{name}_{k}" for k in range(1000))
            part = write_solid(
                Solid(mesh=mesh, hulls=(np.asarray(mesh.vertices),)), name=name,
                family=next(one for one in families if split_of(one, name) == side), source="test",
                licence="Apache-2.0", density=2700.0, dimensions={}, recipe_hash="test",
            )  # fmt: skip
            attempts = synthetic.random_attempts(ATTEMPTS, sizes[name], rng)
            info = replace(synthetic.info(name, seed=number), part_hash=part.content_hash)
            write_shard(shard_path(folder / "data", name, 0), attempts, info)
        write_index(make_index([entry_of(name) for name in sizes], {}, Index(parts={}, left_out={})))
    return Boxes(data=folder / "data", cache=folder / "cache", sizes=sizes)


@pytest.fixture
def boxes(stored_boxes: Boxes, monkeypatch: pytest.MonkeyPatch) -> Boxes:
    """The dataset, with its parts in the cache that programs use."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(stored_boxes.cache))
    return stored_boxes
