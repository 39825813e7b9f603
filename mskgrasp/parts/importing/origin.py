"""The file that a part was imported from, stored with the part."""

from __future__ import annotations

from pathlib import Path

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


def read_origin(folder: Path) -> Origin | None:
    """Read the origin of a stored part; None where it has none, or a damaged one.

    Raises:
        BadPart: There is no part, or its ``part.json`` is damaged.
    """
    try:
        return Origin.model_validate(store.read_record(folder).get(store.ORIGIN))
    except ValidationError:
        return None
