"""Settings of the planner."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mskgrasp.core.config import Config

MIN_QUALITY = 0.5
"""Lowest predicted quality of a grasp that is tried, if no other is set: success is likelier than failure."""


class PlannerConfig(Config):
    """Settings of search and selection; as in the paper but for ``sure_quality`` and ``recentre``."""

    n_candidates: int = Field(default=3200, ge=1, le=1_000_000)
    """Number of grasps that are sampled over the part."""
    top_fraction: float = Field(default=0.03, gt=0.0, le=1.0)
    """Share of the candidates, best quality first, among which the variance score selects."""
    policy: Literal["low_variance", "quality", "certified"] = "low_variance"
    """quality: take the best quality, regardless of its variance (the paper's experiment 1). certified: of a
    known part, take the certified grasp of least expected error; where it has none, the best of
    the simulated ones, else as low_variance."""
    min_quality: float | None = Field(default=None, ge=0.0, le=1.0)
    """Lowest predicted quality of a selected grasp; null: none for a plan and for experiments in simulation,
    which measure what poor grasps do, as the paper did; else 0.5."""
    sure_quality: float = Field(default=0.95, ge=0.0, le=1.0)
    """low_variance chooses among the best grasps of at least this quality; if there are none, it takes the
    best quality. 0: among all of the best, as in the paper."""
    check_fingers: bool = False
    """Exclude grasps whose open fingers would collide with something in the depth image."""
    recentre: bool = True
    """Among the best grasps by variance, try those as well in which the part would hardly move: the same ones
    at the place where it would come to lie between the pads."""
    chunk_size: int = Field(default=400, ge=1, le=65_536)
    """Greatest number of grasps in a CPU's batch: many more do not fit its cache, few have too much overhead.
    (The paper's network, with patches seven times larger, is fastest with 32.)"""

    @property
    def least_quality(self) -> float:
        """Lowest predicted quality of a selected grasp; 0 for none."""
        return self.min_quality or 0.0

    def for_motion(self) -> PlannerConfig:
        """The settings of a program that carries plans out: a bound on the quality unless one is set."""
        if self.min_quality is not None:
            return self
        return self.model_copy(update={"min_quality": MIN_QUALITY})
