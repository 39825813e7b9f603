"""Configuration of a collection run: its parts, its numbers and its physics."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, model_validator

from mskgrasp.core.config import Config
from mskgrasp.core.settings import REGION, ExecutionNoise, Overhead, Physics
from mskgrasp.core.settings.physics import LEAST_RATE_HZ

SUCCESS_IS_OF_RANDOM = (
    "part_filter.min_success and max_success are of random grasps, these are planned: leave them out"
)


class PartFilter(Config):
    """Bounds on the parts to collect; null switches a bound off."""

    min_length: float | None = None
    """Least length of a part's longest axis, m; shorter parts are not collected."""
    max_length: float | None = None
    """Greatest length of a part's longest axis, m; longer parts are not collected."""
    coarse: bool = False
    """Collect parts of grade coarse, too: hulls farther from the mesh than those of a fine part."""
    min_success: float | None = Field(default=None, ge=0, le=1)
    """Parts that fewer grasps of the first shard lift get no further shards, and are marked as not kept."""
    max_success: float | None = Field(default=None, ge=0, le=1)
    """Parts that more grasps of the first shard lift get no further shards, and are marked as not kept."""

    @property
    def bounds_success(self) -> bool:
        """Whether success rates matter."""
        return self.min_success is not None or self.max_success is not None

    @model_validator(mode="after")
    def _check(self) -> PartFilter:
        for name in ("length", "success"):
            low, high = getattr(self, f"min_{name}"), getattr(self, f"max_{name}")
            if low is not None and high is not None and low > high:
                raise ValueError(
                    f"min_{name} {low:g} is above max_{name} {high:g}, no part is between: swap them"
                )
        return self

    def takes_length(self, longest_axis: float) -> bool:
        """Whether a part of this length, metres, is worth collecting."""
        return _between(longest_axis, self.min_length, self.max_length)

    def takes_success(self, rate: float) -> bool:
        """Whether a part of which random grasps lift this share is worth collecting further."""
        return _between(rate, self.min_success, self.max_success)


def _between(value: float, low: float | None, high: float | None) -> bool:
    return (low is None or value >= low) and (high is None or value <= high)


class CollectConfig(Config):
    """Settings of a collection run."""

    out: Path = Path("data/demo")
    """Folder of the dataset; a run into a folder with the same settings resumes it."""
    parts: tuple[str, ...] = ()
    """Names or folders of parts, or sets: starter, catalogue, train, validation, test, new_sizes; empty:
    starter."""
    sample: int = Field(default=0, ge=0)
    """Approximate number of parts, some of every family; 0: all. Only for the catalogue's parts."""
    attempts_per_part: int = Field(default=200, ge=1, le=1_000_000)
    """Grasps for each part."""
    shard_size: int = Field(default=100, ge=1)
    """Grasps in a file; a killed run loses at most the files being made."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Seed of all random numbers; the data do not depend on the number of workers."""
    workers: int = Field(default=0, ge=0)
    """Processes; 0: one for each core."""
    cluster: str | None = None
    """Run on a Ray cluster: auto, or host:port of its head. workers then bounds the cores that are used."""
    labels: tuple[Path, ...] = ()
    """Files of `mskgrasp.dataset export --format labels`: their shards are rendered, not simulated again."""
    planned_by: Path | None = None
    """Folder of a trained model whose planner chooses the grasps, so that networks learn from its choices,
    too (train's --planned); null: grasps are random."""
    part_filter: PartFilter = PartFilter()
    """Bounds on the size of parts and on how easily they are grasped."""
    camera: Overhead = Overhead()
    """The overhead depth camera."""
    noise: ExecutionNoise = ExecutionNoise()
    """Errors of arm, gripper, friction and camera; all off."""
    physics: Physics = Physics()
    """The simulated cell."""

    @model_validator(mode="after")
    def _check(self) -> CollectConfig:
        if self.shard_size > 10_000:
            raise ValueError("shard_size is at most 10000")
        for name in ("rate_hz", "coarse_rate_hz"):
            if getattr(self.physics, name) < LEAST_RATE_HZ:
                raise ValueError(
                    f"physics.{name} is at least {LEAST_RATE_HZ}: labels made with less are wrong"
                )
        if self.labels and self.cluster is not None:
            raise ValueError("labels are rendered by this machine's processes alone: leave cluster out")
        if self.planned_by is not None and self.cluster is not None:
            raise ValueError("grasps are planned by this machine's processes alone: leave cluster out")
        if self.planned_by is not None and self.part_filter.bounds_success:
            raise ValueError(SUCCESS_IS_OF_RANDOM)
        self.camera.check_sees(REGION)
        return self

    def identity(self) -> dict:
        """The settings that determine the data: two runs with the same identity make the same arrays."""
        return self.model_dump(mode="json", exclude={"out", "workers", "cluster", "labels"})
