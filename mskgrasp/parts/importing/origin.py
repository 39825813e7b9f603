"""The file that a part was imported from, stored with the part, and the command that imports it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mskgrasp.core.config import Config
from mskgrasp.core.units import Unit
from mskgrasp.parts import store
from mskgrasp.parts.importing.bodies import Bodies
from mskgrasp.parts.recipes.recipe import STEEL

FAMILY = "imported"
NO_LICENCE = "NOASSERTION"
"""Licence of parts unless stated, as SPDX writes it."""


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


def import_command(path: Path, folder: Path | None = None) -> str:
    """The command that imports a file, with the options of a folder's part that are not the defaults."""
    words = ["python -m mskgrasp.parts import", shlex.quote(str(path))]
    if folder is not None and store.stored_recipe_hash(folder) is not None:
        part, record = store.read_part_and_record(folder)
        origin = origin_of(record)
        words += [f"--density {str(part.density).removesuffix('.0')}"] if part.density != STEEL else []
        words += [f"--unit {origin.unit}"] if origin and origin.unit else []
        words += [f"--{origin.bodies}"] if origin and origin.bodies != "one" else []
        words += [f"--family {shlex.quote(part.family)}"] if part.family != FAMILY else []
        words += [f"--licence {shlex.quote(part.licence)}"] if part.licence != NO_LICENCE else []
    return " ".join(words)
