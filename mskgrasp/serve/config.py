"""Settings of the server."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, field_validator

from mskgrasp.core.config import Config
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.planning.config import PlannerConfig


class ServeConfig(Config):
    """Settings of the server."""

    models: Path = PRETRAINED
    """Folder with model.safetensors and model.json; by default the shipped one."""
    cell: Path | None = None
    """YAML file of the cell whose table and region the images show; null: those of the simulated cell.
    Nothing of it is connected."""
    host: str = "127.0.0.1"
    """Address to listen on; any but one of this machine alone needs --token-file."""
    port: int = Field(default=8093, ge=0, le=65535)
    """Port to listen on; 0: a free one, which is printed."""
    token_file: Path | None = None
    """File with the token, one word of 16 characters or more, that every client has to send; null: none."""
    workers: int = Field(default=0, ge=0, le=256)
    """Processes that plan, each on one core; 0: one per core."""
    queue: int = Field(default=4, ge=0, le=100)
    """Requests that may wait for each worker; one more is answered 503."""
    timeout_s: float = Field(default=30.0, gt=0, le=600)
    """Longest time to receive a request, and longest time to answer it, seconds."""
    max_body_mb: float = Field(default=20.0, gt=0, le=200)
    """Largest request, megabytes."""
    planner: PlannerConfig = PlannerConfig()
    """Settings of the choice of the grasp; min_quality is 0.5 if not set, since plans are to be executed."""

    @field_validator("planner")
    @classmethod
    def _without_cad(cls, planner: PlannerConfig) -> PlannerConfig:
        if planner.policy == "certified":
            raise ValueError(
                "policy certified needs the part's CAD, which no request holds; use low_variance"
            )
        return planner
