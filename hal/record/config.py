"""Configuration of a recording."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, model_validator

from mskgrasp.core.config import Config


class RecordConfig(Config):
    """Settings of a recording."""

    cell: Path
    """YAML file of the cell, for example configs/cells/sapien.yaml."""
    out: Path
    """The recording, an HDF5 file; must not exist yet."""
    frames: int = Field(default=10, ge=1, le=100_000)
    """Number of frames."""
    interval: float = Field(default=0.5, ge=0, le=3600)
    """Time from one frame to the next, s."""
    run: str | None = None
    """Record a run of this program instead of frames, as in "mskgrasp.evaluate --models models/demo". It runs
    on the recorded cell: leave its own --cell out."""

    @model_validator(mode="after")
    def _frames_or_program(self) -> RecordConfig:
        fields = type(self).model_fields
        names = [name for name in ("frames", "interval") if getattr(self, name) != fields[name].default]
        if self.run is not None and names:
            given = " and ".join(f"--{name}" for name in names)
            raise ValueError(f"--run records what the program does: leave out {given}")
        return self
