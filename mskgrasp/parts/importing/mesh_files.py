"""Triangles of CAD files of every supported format, in millimetres."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mskgrasp.core.errors import BadPart
from mskgrasp.core.units import MILLIMETRES, Unit
from mskgrasp.parts.importing.formats import MOST_TRIANGLES, Loaded, Unreadable
from mskgrasp.parts.importing.formats.glb import load_glb
from mskgrasp.parts.importing.formats.obj import load_obj
from mskgrasp.parts.importing.formats.ply import load_ply
from mskgrasp.parts.importing.formats.step import load_step
from mskgrasp.parts.importing.formats.stl import load_stl
from mskgrasp.parts.importing.formats.three_mf import load_3mf
from mskgrasp.parts.solids.surface import Surface

LOADERS = {
    ".stl": load_stl,
    ".obj": load_obj,
    ".ply": load_ply,
    ".glb": load_glb,
    ".3mf": load_3mf,
    ".step": load_step,
    ".stp": load_step,
}

MOST_BYTES = 1 << 30

USUAL_SIZE_MM = (20.0, 150.0)
"""Sizes of the paper's parts; others are imported with a warning."""

POSSIBLE_SIZE_MM = (2.0, 500.0)
"""Shorter parts are within the contact offset of the simulation, longer ones exceed the workspace."""


@dataclass(frozen=True, kw_only=True)
class MeshFile:
    """Content of a file.

    Attributes:
        objects: As separated in the file, millimetres; an STL, OBJ or PLY is one object.
        unit: Unit of the file's coordinates, stated or assumed.
        states_unit: The file states it, so that no other may be chosen.
        notes: Remarks for the user.
    """

    objects: tuple[Surface, ...]
    unit: str
    states_unit: bool
    notes: tuple[str, ...]


def read_content(path: Path) -> bytes:
    """A file's bytes.

    Raises:
        BadPart: It is not a regular file with a known suffix, or is too large, empty, or not readable.
    """
    if path.is_dir():
        raise BadPart(f"{path} is a folder: give it without a pattern to import the files in it")
    if path.suffix.lower() not in LOADERS:
        raise BadPart(
            f"{path} has the suffix {path.suffix or '(none)'!r}, CAD files end in {', '.join(LOADERS)}: "
            "export it as one of these"
        )
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise BadPart(f"{path} is a device or a pipe: give a file")
        if status.st_size > MOST_BYTES:
            raise BadPart(
                f"{path} has {status.st_size / 2**30:.1f} GiB, the most is {MOST_BYTES // 2**30}: "
                "export it with a coarser mesh"
            )
        content = path.read_bytes()
    except OSError as error:
        raise BadPart(f"cannot read {path}: {error.strerror}; check the path and its permissions") from error
    if not content.strip():
        raise BadPart(f"{path} is empty: export it again from the CAD program")
    return content


def read_mesh(path: Path, content: bytes, unit: Unit | None) -> MeshFile:
    """The triangles of a file.

    Args:
        path: Its suffix determines the format.
        content: Its bytes.
        unit: Unit of the coordinates; None: that of the format, or mm where it states none.

    Raises:
        BadPart: The content is damaged, has no triangles, states another unit, or has an impossible size.
    """
    suffix = path.suffix.lower()
    try:
        loaded = LOADERS[suffix](content)
    except Unreadable as error:
        raise BadPart(f"{path} {error}") from error
    except (ValueError, KeyError, IndexError, TypeError, OverflowError, MemoryError) as error:
        reason = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise BadPart(f"{path} is not a readable {suffix[1:].upper()} ({reason}): export it again") from error
    objects = [item for item in loaded.objects if len(item.faces)]
    if not objects:
        raise BadPart(f"{path} holds no triangles: export it again from the CAD program as a solid")
    for item in objects:
        _check_arrays(path, item)
    name, scale = _unit(path, loaded, unit)
    objects = [Surface(vertices=item.vertices * scale, faces=item.faces) for item in objects]
    states_unit = loaded.unit is not None and not loaded.unit_by_convention
    _check_size(path, objects, name, scale, may_choose=not states_unit)
    notes = list(loaded.notes)
    if loaded.unit_by_convention and unit is not None and scale != loaded.unit_mm:
        notes.append(
            f"read in {unit} as --unit says; {suffix[1:].upper()} is in {loaded.unit} by its standard"
        )
    return MeshFile(objects=tuple(objects), unit=name, states_unit=states_unit, notes=tuple(notes))


def length_text(millimetres: float) -> str:
    """``0.04 mm``, ``82.5 mm``, ``40 m``."""
    return f"{millimetres / 1000:.4g} m" if millimetres >= 1000 else f"{millimetres:.4g} mm"


def size_hint(longest_mm: float, unit: str, scale: float) -> str:
    """The --unit that would give a part of usual size, or that there is none."""
    for low, high in (USUAL_SIZE_MM, POSSIBLE_SIZE_MM):
        fitting = [
            f"--unit {name} would make it {length_text(longest_mm / scale * factor)}"
            for name, factor in MILLIMETRES.items()
            if name != unit and low <= longest_mm / scale * factor <= high
        ]
        if fitting:
            return " or ".join(fitting)
    return "no other --unit makes it fit; leave it out, or scale it in the CAD program"


def _check_arrays(path: Path, item: Surface) -> None:
    if len(item.faces) > MOST_TRIANGLES:
        raise BadPart(
            f"{path} has {len(item.faces):,} triangles, the most is {MOST_TRIANGLES:,}: export it coarser"
        )
    if int(item.faces.max()) >= len(item.vertices) or int(item.faces.min()) < 0:
        raise BadPart(f"{path}: a face refers to a missing vertex (truncated?): export it again")
    if not np.isfinite(item.vertices).all():
        raise BadPart(f"{path} has coordinates that are not finite: export it again from the CAD program")


def _unit(path: Path, loaded: Loaded, unit: Unit | None) -> tuple[str, float]:
    """The unit's name and its length in millimetres."""
    if loaded.unit is None:
        name = unit or "mm"
        return name, MILLIMETRES[name]
    if unit is None:
        return loaded.unit, loaded.unit_mm
    if loaded.unit_by_convention or MILLIMETRES[unit] == loaded.unit_mm:
        return unit, MILLIMETRES[unit]
    raise BadPart(
        f"{path} states its own unit, {loaded.unit}, and --unit says {unit}: omit --unit, or export "
        "the file with the right unit"
    )


def _check_size(path: Path, objects: list[Surface], unit: str, scale: float, *, may_choose: bool) -> None:
    low = np.min([item.triangles.min(axis=(0, 1)) for item in objects], axis=0)
    high = np.max([item.triangles.max(axis=(0, 1)) for item in objects], axis=0)
    longest = float((high - low).max())
    if POSSIBLE_SIZE_MM[0] <= longest <= POSSIBLE_SIZE_MM[1] or longest == 0:
        return
    remedy = size_hint(longest, unit, scale) if may_choose else "leave it out, or scale it in the CAD program"
    raise BadPart(
        f"{path} is {length_text(longest)} long when read in {unit}; the limits are "
        f"{POSSIBLE_SIZE_MM[0]:g} to {POSSIBLE_SIZE_MM[1]:g} mm: {remedy}"
    )
