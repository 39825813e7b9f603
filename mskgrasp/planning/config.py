"""Settings of the planner."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mskgrasp.core.config import Config


class PlannerConfig(Config):
    """Settings of the search and the selection; the defaults are the paper's."""

    n_candidates: int = Field(default=3200, ge=1)
    top_fraction: float = Field(default=0.03, gt=0.0, le=1.0)
    """Share of the candidates, best quality first, among which the variance score selects."""
    policy: Literal["low_variance", "quality"] = "low_variance"
    """quality: take the best quality, regardless of its variance (the paper's experiment 1)."""
    min_quality: float = Field(default=0.0, ge=0.0, le=1.0)
    """Lowest predicted quality of a selected grasp."""
    check_fingers: bool = False
    """Exclude grasps whose open fingers would collide with something in the depth image."""
    refinements: int = Field(default=0, ge=0, le=20)
    """Rounds of the cross-entropy method: grasps are drawn near the best ones and scored."""
    chunk_size: int = Field(default=640, ge=1)
    """Grasps in a batch: many more do not fit a CPU's cache, few have too much overhead. (The
    paper's network, with patches seven times larger, is fastest with 32.)"""

    @property
    def searches(self) -> bool:
        """Whether more than one grasp is scored at the end."""
        return self.check_fingers or self.refinements > 0
