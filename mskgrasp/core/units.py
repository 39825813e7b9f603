"""Units of length in CAD files."""

from __future__ import annotations

from typing import Literal

Unit = Literal["mm", "m", "in"]
MILLIMETRES: dict[str, float] = {"mm": 1.0, "m": 1000.0, "in": 25.4}
