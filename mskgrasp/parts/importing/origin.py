"""The file that a part was imported from, stored with the part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mskgrasp.core.config import Config
from mskgrasp.core.units import Unit
from mskgrasp.parts import store
from mskgrasp.parts.importing.bodies import Bodies


class Origin(Config):
    """A file and those options of its import that the part itself does not tell."""

    path: Path
    """The file, absolute; it may have been moved or changed since."""
    sha256: str
    """Hex digest of its content."""
    unit: Unit | None
    """As given; None where the format's own was read."""
    bodies: Bodies
    """What was done with several bodies."""


def origin_of(record: dict[str, Any]) -> Origin | None:
    """The origin in a ``part.json``; None where it has none, or a damaged one."""
    try:
        return Origin.model_validate(record.get(store.ORIGIN))
    except ValidationError:
        return None
