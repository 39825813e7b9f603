"""A part by name, folder or CAD file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.builtin import find_part
from mskgrasp.parts.part import Part

if TYPE_CHECKING:
    from mskgrasp.core.units import Unit


def load_part(source: str | Path, *, unit: Unit | None = None) -> Part:
    """Load a part; a built-in one is built and a CAD file imported the first time, which takes seconds.

    A CAD file that was imported before under its own name is the part that it became then; with another
    ``unit``, or once the file has changed, it is imported again with the other options of that import. A file
    that was never imported becomes a part of its name with the density of steel.

    Args:
        source: Name of a part, a part folder, or an STL, OBJ, PLY, GLB, 3MF or STEP file.
        unit: Unit of a CAD file's coordinates; None: that of the import, or of the format, or mm where it
            states none.

    Raises:
        UnknownPart: There is no such part: the message lists similar names, or names the missing extra.
        BadPart: The file or folder cannot be used as a part, or a unit is given for no file.
    """
    if Path(source).is_file():
        from mskgrasp.parts.importing.import_file import part_of_file  # the readers load slowly

        return part_of_file(Path(source), unit=unit)
    part = find_part(source)
    if unit is not None:
        raise BadPart(f"{source} is no CAD file, whose unit could be {unit}: leave unit out")
    return part
