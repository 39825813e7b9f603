"""Import of one CAD file as a part; files that cannot be simulated faithfully are refused."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import QhullError

from mskgrasp.core.errors import BadPart, printable
from mskgrasp.core.shipped import is_example
from mskgrasp.core.units import Unit
from mskgrasp.parts import store
from mskgrasp.parts.builtin import builtin_names
from mskgrasp.parts.importing.bodies import Bodies, repair_bodies
from mskgrasp.parts.importing.mesh_files import POSSIBLE_SIZE_MM, read_content, read_mesh
from mskgrasp.parts.importing.origin import FAMILY, NO_LICENCE, Origin, import_command, origin_of
from mskgrasp.parts.names import SETS, legal_name
from mskgrasp.parts.part import Part
from mskgrasp.parts.recipes.recipe import STEEL
from mskgrasp.parts.solids.mesh_pieces import mesh_pieces
from mskgrasp.parts.solids.one_thread import hold_manifold_to_one_thread
from mskgrasp.parts.solids.simplify import for_collision
from mskgrasp.parts.solids.solid import Solid
from mskgrasp.parts.versions import IMPORT_VERSION, PART_VERSION, stamp
from mskgrasp.parts.write_solid import write_solid
from mskgrasp.runtime.progress import note

USUAL_DENSITY = (10.0, 25_000.0)
"""From foam to osmium, kg/m^3."""

_OTHER = "choose another, python -m mskgrasp.parts import FILE --name NAME"


@dataclass(frozen=True, kw_only=True)
class Imported:
    """Result of importing one file.

    Attributes:
        parts: One, or with ``bodies="split"`` one for each body.
        unchanged: The parts folder had them already, from the same file with the same options.
        unit: Unit of the file's coordinates; empty where the file was not read.
        notes: Repairs and remarks, one sentence each.
        states_unit: The file states its unit, so that no other may be chosen.
    """

    parts: tuple[Part, ...]
    unchanged: bool
    unit: str
    notes: tuple[str, ...]
    states_unit: bool = False


def import_file(
    path: Path,
    *,
    name: str | None = None,
    family: str = FAMILY,
    unit: Unit | None = None,
    density: float = STEEL,
    licence: str = NO_LICENCE,
    bodies: Bodies = "one",
    check_name: Callable[[str], None] = lambda name: None,
) -> Imported:
    """Import a file as a part, replacing an imported part of the same name.

    Args:
        path: STL, OBJ, PLY, GLB, 3MF or STEP.
        name: The part's name; by default the file's, made legal.
        family: Kind of part.
        unit: Unit of the file's coordinates; None: that of the format, or mm where it states none.
        density: kg/m^3.
        licence: SPDX identifier of the mesh's licence.
        bodies: Whether several bodies are refused, split into parts ``NAME-1``, ``NAME-2``, ... by
            decreasing volume, or joined into one.
        check_name: Called with each name before writing; raises BadPart for a taken one.

    Raises:
        BadPart: The file cannot become a part, or the name belongs to a built-in part; the message gives the
            reason.
    """
    check_density(density)
    hold_manifold_to_one_thread()
    name = legal_name(path.stem if name is None else name)
    content = read_content(path)
    sha256 = _sha256(content)
    origin = Origin(path=path.resolve(), sha256=sha256.hex(), unit=unit, bodies=bodies)
    digest = _recipe_hash(path.resolve(), sha256, family, unit, density, licence, bodies)
    if bodies != "split":
        _check_available(name, check_name)
        known = _known(name, digest)
        if known is not None:
            return Imported(parts=(known,), unchanged=True, unit="", notes=())
    file = read_mesh(path, content, unit)
    del content  # up to a gigabyte, and repairs need memory
    try:
        repaired = repair_bodies(file.objects, bodies=bodies)
    except BadPart as error:
        raise BadPart(f"{path} {error}") from error
    count = len(repaired.bodies)
    names = [name] if count == 1 else [f"{name[: 79 - len(str(count))]}-{i + 1}" for i in range(count)]
    for each, mesh in zip(names, repaired.bodies, strict=True):
        _check_available(each, check_name)
        longest = float(np.max(mesh.extents))
        if longest < POSSIBLE_SIZE_MM[0]:
            raise BadPart(
                f"{path}: the body {each} is {longest:.3g} mm long, the least is {POSSIBLE_SIZE_MM[0]:g} mm: "
                "remove it in the CAD program"
            )
    parts, unchanged = [], True
    for number, (each, mesh) in enumerate(zip(names, repaired.bodies, strict=True)):
        recipe_hash = digest if count == 1 else f"{digest[:56]}-{number + 1:07d}"
        known = _known(each, recipe_hash)
        if known is None:
            unchanged = False
            known = _make(mesh, path, each, family, density, licence, recipe_hash, origin)
        parts.append(known)
    notes = (*file.notes, *repaired.notes)
    if bodies == "split" and (left := _left_of_split(name, names, path)):
        notes += (f"kept {', '.join(left)} of an earlier import of it: delete the folders if not wanted",)
    return Imported(
        parts=tuple(parts), unchanged=unchanged, unit=file.unit, notes=notes, states_unit=file.states_unit
    )


def import_part(path: Path, **options: object) -> Part:
    """The part of a file that holds one; the options are those of import_file."""
    return import_file(path, **options).parts[0]  # pyright: ignore[reportArgumentType]


def part_of_file(path: Path, *, unit: Unit | None = None) -> Part:
    """The part of a CAD file that a program is given: as it was imported from it, else imported as steel.

    A file that has changed since is imported again with the options of that import, and a note. A shipped
    example becomes a part whose name begins with ``example_``, so that it replaces none of the user's.

    Args:
        path: As in `import_file`.
        unit: As in `import_file`; None: that of the import. A file that was imported with another one is
            imported again, with the other options of that import.

    Raises:
        BadPart: As in `import_file`; or the part of this name is damaged or was made of another file.
    """
    name = legal_name(f"example_{path.stem}" if is_example(path) else path.stem)
    folder = store.parts_folder() / name
    if name in builtin_names() or not store.is_stored(folder):
        return import_part(path, name=name, unit=unit)
    known, record = store.read_part_and_record(folder)
    origin, sha256 = origin_of(record), _sha256(read_content(path))
    if origin is None:
        raise BadPart(
            f"the part {name!r} does not say of which file it was made, as those of today do: import it "
            f"again, {import_command(path, folder)}, with its --unit if that is not mm"
        )
    changed = sha256.hex() != origin.sha256
    if changed and path.resolve() != origin.path:
        raise BadPart(
            f"the part {name!r} was made of {origin.path}, and {path} is another file: import it, "
            f"{import_command(path, folder)}, in place of that part, or with --name"
        )
    options = known.family, origin.unit, known.density, known.licence, origin.bodies
    digest = _recipe_hash(origin.path, bytes.fromhex(origin.sha256), *options)
    current = digest == record.get("recipe_hash")
    if current and not changed and unit in (None, origin.unit):
        return known
    unit = unit or origin.unit
    if changed:
        read_in = f", --unit {unit}" if unit else ""
        note(f"{path} has changed since its import; imported again with {known.density:g} kg/m^3{read_in}")
    elif not current:
        note(f"{path} was imported by another version of mskgrasp; imported again")
    imported = import_file(
        path, name=name, unit=unit, family=known.family, density=known.density, licence=known.licence,
        bodies=origin.bodies,
    )  # fmt: skip
    if len(imported.parts) != 1:
        names = ", ".join(part.name for part in imported.parts)
        raise BadPart(f"{path} holds {len(imported.parts)} bodies now, which are the parts {names}: name one")
    return imported.parts[0]


def _sha256(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


def _recipe_hash(
    path: Path, sha256: bytes, family: str, unit: Unit | None, density: float, licence: str, bodies: Bodies
) -> str:
    """Identifier of a file's content, ``sha256``, with the options of its import."""
    versions = stamp("part", PART_VERSION), stamp("import", IMPORT_VERSION)
    recipe = [family, unit, float(density), licence, bodies, path.name, *versions]
    return hashlib.sha256(json.dumps(recipe).encode() + sha256).hexdigest()


def check_density(density: float) -> None:
    """Check that a density is plausible.

    Raises:
        BadPart: No solid has this density.
    """
    if not USUAL_DENSITY[0] <= density <= USUAL_DENSITY[1]:
        grams = "; in kg/m^3, not g/cm^3" if 0 < density < USUAL_DENSITY[0] else ""
        raise BadPart(
            f"density {density:g} kg/m^3 is not between {USUAL_DENSITY[0]:g} and {USUAL_DENSITY[1]:g}: "
            f"steel has 7850, aluminium 2700, ABS 1050{grams}"
        )


def _check_available(name: str, check_name: Callable[[str], None]) -> None:
    if name in builtin_names():
        raise BadPart(f"the name {name!r} belongs to a built-in part: {_OTHER}")
    if name in SETS:
        raise BadPart(f"the name {name!r} stands for a set of parts: {_OTHER}")
    check_name(name)


def _known(name: str, recipe_hash: str) -> Part | None:
    folder = store.parts_folder() / name
    try:
        part, record = store.read_part_and_record(folder)
    except BadPart:
        return None
    return part if record.get("recipe_hash") == recipe_hash and origin_of(record) is not None else None


def _left_of_split(name: str, names: Sequence[str], path: Path) -> list[str]:
    """Parts that an earlier split import of the same file made, and this one did not."""
    # Names of 80 characters are cut off before their number.
    pattern = re.compile(re.escape(name[:70]) + (".*" if len(name) > 70 else "") + r"(-\d+)?")
    left = []
    for folder in store.parts_folder().glob(f"{name[:70]}*"):
        if folder.name in names or not pattern.fullmatch(folder.name):
            continue
        try:
            origin = origin_of(store.read_record(folder))
        except BadPart:
            continue
        if origin is not None and (origin.path, origin.bodies) == (path.resolve(), "split"):
            left.append(folder.name)
    return sorted(left)


def _make(
    mesh: trimesh.Trimesh,
    path: Path,
    name: str,
    family: str,
    density: float,
    licence: str,
    recipe_hash: str,
    origin: Origin,
) -> Part:
    try:
        return write_solid(
            Solid(mesh=mesh, hulls=mesh_pieces(for_collision(mesh))),
            name=name,
            family=family,
            source=f"imported from {printable(path.name)}",
            licence=licence,
            density=density,
            dimensions={
                f"extent_{axis}": float(size) / 1000 for axis, size in zip("xyz", mesh.extents, strict=True)
            },
            recipe_hash=recipe_hash,
            coarse=True,
            origin=origin.model_dump(mode="json"),
        )
    except BadPart as error:
        raise BadPart(f"{path}: {error}") from error
    except QhullError as error:
        raise BadPart(
            f"{path}: a convex piece of the mesh is flat: repair its thinnest walls, or make them thicker"
        ) from error
