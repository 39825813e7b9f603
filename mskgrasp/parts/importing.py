"""Mesh files made into parts; what cannot be simulated truly is refused."""

from __future__ import annotations

import hashlib
import io
import json
import re
import unicodedata
import warnings
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from mskgrasp.errors import BadPart
from mskgrasp.parts import store
from mskgrasp.parts.build import LEGAL_NAME, builtin_names, source_digest, write_solid
from mskgrasp.parts.decompose import convex_pieces, is_manifold
from mskgrasp.parts.part import Part
from mskgrasp.parts.solid import Solid

SUFFIXES = ("stl", "obj", "ply")
MILLIMETRES = {"mm": 1.0, "m": 1000.0, "in": 25.4}
USUAL_SIZE_MM = (20.0, 150.0)

_SPELLED = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "ø": "oe", "å": "aa", "æ": "ae"})


def import_part(
    path: Path,
    *,
    name: str | None = None,
    family: str = "imported",
    unit: Literal["mm", "m", "in"] = "mm",
    density: float = 7850.0,
    licence: str = "NOASSERTION",
) -> Part:
    """Makes a part of a mesh file, replacing an imported part of the same name.

    Args:
        path: STL, OBJ or PLY.
        name: The part's name; by default the file's, made legal.
        family: Kind of part.
        unit: Of the file's coordinates.
        density: kg/m^3.
        licence: SPDX identifier of the mesh's licence.

    Raises:
        BadPart: The file is damaged, open, empty, or of several bodies, or the name is a built-in part's.
    """
    if not (np.isfinite(density) and density > 0):
        raise BadPart(f"density {density} kg/m^3 is not positive: steel has 7850, aluminium 2700, ABS 1050")
    name = legal_name(path.stem if name is None else name)
    if name in builtin_names():
        raise BadPart(f"the name {name!r} belongs to a built-in part: choose another with --name")
    content = _content(path)
    recipe = [name, family, unit, density, licence, path.name, source_digest()]
    recipe_hash = hashlib.sha256(json.dumps(recipe).encode() + content).hexdigest()
    folder = store.parts_folder() / name
    if store.recipe_hash(folder) == recipe_hash:
        return store.load_part(folder)
    mesh = read_mesh(path, content)
    mesh.apply_scale(MILLIMETRES[unit])
    return write_solid(
        Solid(mesh=mesh, hulls=convex_pieces(mesh)),
        name=name,
        family=family,
        source=f"imported from {path.name}",
        licence=licence,
        density=density,
        dimensions={
            f"extent_{axis}": float(size) / 1000 for axis, size in zip("xyz", mesh.extents, strict=True)
        },
        recipe_hash=recipe_hash,
    )


def legal_name(text: str) -> str:
    """A part's name made of any text: lower case letters, digits, - and _.

    Raises:
        BadPart: Nothing legal is left.
    """
    plain = unicodedata.normalize("NFC", text).lower().translate(_SPELLED)
    plain = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
    name = re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-_")[:80].rstrip("-_")
    if not LEGAL_NAME.fullmatch(name):
        raise BadPart(f"no part name can be made of {text!r}: give one with --name (a-z, 0-9, - and _)")
    return name


def read_mesh(path: Path, content: bytes) -> trimesh.Trimesh:
    """A closed single body from a mesh file, wound outwards, in the file's unit.

    Raises:
        BadPart: It cannot be read, or is not a closed single body.
    """
    try:
        # From memory and without materials, so that the file cannot make the reader open others.
        options = {"skip_materials": True} if path.suffix.lower() == ".obj" else {}
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            mesh = trimesh.load_mesh(
                io.BytesIO(content), file_type=path.suffix.lower()[1:], process=False, **options
            )
    except Exception as error:  # the readers raise whatever they stumble over
        reason = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise BadPart(
            f"{path} is no readable {path.suffix[1:].upper()} ({reason}): export it again"
        ) from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise BadPart(f"{path} holds no triangles: export it again from the CAD program as a mesh")
    if len(mesh.vertices) <= int(np.max(mesh.faces)) or int(np.min(mesh.faces)) < 0:
        raise BadPart(f"{path}: a face names a vertex that is not there (truncated?): export it again")
    if not np.isfinite(mesh.vertices).all():
        raise BadPart(f"{path} has coordinates that are not finite: export it again from the CAD program")
    return _closed_body(path, mesh)


def _content(path: Path) -> bytes:
    if path.suffix.lower()[1:] not in SUFFIXES:
        raise BadPart(
            f"{path} has the suffix {path.suffix or '(none)'!r}; mesh files end in "
            f"{', '.join('.' + suffix for suffix in SUFFIXES)}: convert it"
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadPart(f"cannot read {path}: {error.strerror}: check the path") from error
    if not content.strip():
        raise BadPart(f"{path} is empty: export it again from the CAD program")
    return content


def _closed_body(path: Path, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(np.asarray(mesh.vertices, dtype=np.float64), mesh.faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if (
        len(mesh.faces) == 0
        or np.ptp(mesh.vertices, axis=0).min() <= 1e-9 * np.ptp(mesh.vertices, axis=0).max()
    ):
        raise BadPart(f"{path} is flat, its volume is zero: give it a thickness in the CAD program")
    if not mesh.is_watertight:
        edges = np.sort(mesh.edges, axis=1)
        _, count = np.unique(edges, axis=0, return_counts=True)
        raise BadPart(
            f"{path} is not watertight ({int((count != 2).sum())} of {len(count)} edges do not join "
            "two faces): close the holes, for example with MeshLab's 'Close Holes', or export a solid"
        )
    if mesh.body_count > 1:
        raise BadPart(
            f"{path} has {mesh.body_count} separate bodies (a closed cavity counts as one): "
            "join them, or export each to its own file"
        )
    trimesh.repair.fix_normals(mesh)
    if mesh.volume < 0:
        mesh.invert()
    if mesh.volume <= 1e-7 * float(np.prod(mesh.extents)):
        raise BadPart(f"{path} has the volume zero (two sheets back to back?): give it a thickness")
    if not is_manifold(mesh):
        raise BadPart(
            f"{path} is no proper solid (its faces cannot all be wound outwards): repair and export it again"
        )
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
