"""Origin of the labels that a model learned: simulation, settings and hand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from mskgrasp.core.config import Config
from mskgrasp.dataset import ShardInfo


class LabelSource(Config):
    """What all attempts of a collection share, as stored in ``model.json``; SI units."""

    simulation: str
    """Version of the simulation; "unknown" where it was not recorded."""
    fidelity: str
    """Class of the labels, "cpu" or "gpu"."""
    physics: dict[str, Any]
    """Settings of the simulated cell."""
    noise: dict[str, Any]
    """Simulated errors of the cell, with the ranges that were drawn from; empty: none."""
    hand: dict[str, float]
    """Measures of the hand; empty: not recorded."""
    camera_height: float
    """Height of the camera above the table."""
    seed: int
    """Seed of the collection."""


def source_of(info: ShardInfo) -> LabelSource:
    """The source of a shard's labels."""
    return LabelSource(
        simulation=info.versions.get("simulation", "unknown"),
        fidelity=info.fidelity,
        physics=info.physics,
        noise={name: value for name, value in info.noise.items() if value},
        hand=info.hand,
        camera_height=float(info.T_base_camera.position[2]) - info.table_z,
        seed=info.seed,
    )


def distinct(sources: Iterable[LabelSource]) -> tuple[LabelSource, ...]:
    """Each source once, in the order in which they are met."""
    found: list[LabelSource] = []
    for source in sources:
        if source not in found:
            found.append(source)
    return tuple(found)
