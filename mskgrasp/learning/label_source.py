"""Origin of the labels that a model learned: simulation, settings and hand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import field_validator

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadDataset
from mskgrasp.dataset import ShardInfo

SAME_HEIGHT = 0.05 + 1e-9
"""Camera heights that differ by less are the same, metres: perspective changes by a twentieth."""


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
    planner: str = ""
    """Digest of the model whose planner chose the grasps; empty: they are random."""

    @field_validator("physics", "noise")
    @classmethod
    def _numbers(cls, values: dict[str, Any]) -> dict[str, Any]:
        """A model's description may come from anywhere; its numbers are compared with a cell's."""
        for name, value in values.items():
            bounds = value if isinstance(value, list | tuple) else [value, value]
            if len(bounds) != 2 or not all(isinstance(one, int | float) for one in bounds):
                raise ValueError(f"{name} must be a number, or the bounds of a range, got {value!r}")
        return values


def source_of(info: ShardInfo) -> LabelSource:
    """The source of a shard's labels.

    Raises:
        BadDataset: A setting in the shard is no number.
    """
    values = dict(
        simulation=info.versions.get("simulation", "unknown"),
        fidelity=info.fidelity,
        physics=info.physics,
        noise={name: value for name, value in info.noise.items() if value},
        hand=info.hand,
        camera_height=float(info.T_base_camera.position[2]) - info.table_z,
        seed=info.seed,
        planner=info.planner,
    )
    try:
        return LabelSource.model_validate(values)
    except ValueError as error:
        raise BadDataset(f"a shard of part '{info.part}': {' '.join(str(error).split())}") from error


def distinct(sources: Iterable[LabelSource]) -> tuple[LabelSource, ...]:
    """Each source once, in the order in which they are met."""
    found: list[LabelSource] = []
    for source in sources:
        if source not in found:
            found.append(source)
    return tuple(found)


def source_text(source: LabelSource) -> str:
    """Simulation, camera and drawn errors in one line."""
    drawn = "; ".join(
        f"{name} {' to '.join(map(str, value)) if isinstance(value, (list, tuple)) else value}"
        for name, value in sorted(source.noise.items())
    )
    return (
        f"simulation version {source.simulation}, fidelity {source.fidelity}, camera "
        f"{source.camera_height:.2f} m over the table, errors of the cell: {drawn or 'none'}"
        + (", grasps chosen by a planner" if source.planner else "")
    )


def other_conditions(source: LabelSource, physics: Config | None, camera_height: float | None) -> list[str]:
    """Conditions of a cell that the labels were not made under, in words.

    Args:
        source: Of a model's labels.
        physics: Settings of a simulated cell; None: a real one.
        camera_height: Height of the camera above the table, metres; None: not known.
    """
    found = []
    if camera_height is not None and abs(camera_height - source.camera_height) > SAME_HEIGHT:
        found.append(f"camera {camera_height:.2f} m over the table, not {source.camera_height:.2f}")
    for name, value in ({} if physics is None else physics.model_dump()).items():
        drawn = source.noise.get(name)
        low, high = drawn if isinstance(drawn, (list, tuple)) else 2 * (source.physics.get(name),)
        if name == "skip_air" or low is None or high is None:  # skipping air changes no label
            continue
        if not low <= value <= high:
            found.append(f"{name} {value:g}, not {low:g}" + (f" to {high:g}" if high > low else ""))
    return found
