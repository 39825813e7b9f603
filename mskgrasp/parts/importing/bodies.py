"""Solid bodies of the closed surfaces in a file: outer shells with the shells of their cavities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import trimesh
from manifold3d import Manifold, OpType

from mskgrasp.core.errors import BadPart
from mskgrasp.parts.importing.repair import Repairs, close_surface, count_of, wind_consistently
from mskgrasp.parts.importing.winding import LINES, miscounted_fraction, winding_number
from mskgrasp.parts.solids.simplify import decimate
from mskgrasp.parts.solids.surface import Surface, joined_surfaces, manifold_of, surface_of

MOST_BODIES = 500
"""More indicate lettering, a lattice or scan debris instead of a part."""

MISCOUNTED = 0.005
"""Largest share of the volume that may be counted twice where a surface crosses itself."""

Bodies = Literal["one", "split", "union"]


@dataclass(frozen=True, kw_only=True)
class RepairedBodies:
    """Closed bodies, millimetres, wound outwards, by decreasing volume; the repairs, one sentence each."""

    bodies: tuple[trimesh.Trimesh, ...]
    notes: tuple[str, ...]


def repair_bodies(objects: Sequence[Surface], *, bodies: Bodies) -> RepairedBodies:
    """Make closed bodies from the objects of a file.

    Args:
        objects: As separated in the file (an STL is one object), millimetres.
        bodies: Whether several bodies are refused, kept apart, or joined.

    Raises:
        BadPart: No proper body can be made; the message starts with "is" or "has" and names no file.
    """
    surfaces, repairs = _closed(objects)
    solids: list[Manifold] = []
    for surface in surfaces:
        found, turned = _solids(surface)
        solids += found
        repairs += Repairs(turned=turned)
    sentences = list(repairs.sentences())
    if len(solids) > 1:
        solids.sort(key=lambda solid: -solid.volume())
        if bodies == "one":
            raise BadPart(_several(solids))
        if bodies == "union":
            sentences.append(f"joined {count_of(len(solids), 'body')} into one")
            solids = _joined(solids)
        else:
            sentences.append(f"split into {count_of(len(solids), 'part')}")
    meshes = []
    for solid in solids:
        solid, sentence = decimate(solid)
        sentences += [sentence] if sentence else []
        surface = surface_of(solid)
        sentences += _check_volume(surface)
        meshes.append(trimesh.Trimesh(surface.vertices, surface.faces, process=False))
    return RepairedBodies(bodies=tuple(meshes), notes=tuple(sentences))


def _closed(objects: Sequence[Surface]) -> tuple[list[Surface], Repairs]:
    """Each object closed separately or, where one is open (faces coloured one by one), all of them as one."""
    try:
        results = [close_surface(item) for item in objects]
    except BadPart:
        if len(objects) == 1:
            raise
        results = [close_surface(joined_surfaces(objects))]
    return [surface for surface, _ in results], sum((repairs for _, repairs in results), Repairs())


def _solids(surface: Surface) -> tuple[list[Manifold], int]:
    """The bodies of a closed surface, each with its cavities, and the number of faces that were turned."""
    surface, piece, turned = wind_consistently(surface)
    shells = [manifold_of(surface)]
    if piece.max() > 0 or surface.volume <= 0:
        if piece.max() >= MOST_BODIES:
            raise BadPart(
                f"has {piece.max() + 1:,} separate bodies, the most is {MOST_BODIES}: remove loose bodies "
                "(lettering, scan debris), or export the part alone"
            )
        inward = _inward(surface, piece)[piece]
        turned = turned ^ inward
        faces = np.where(inward[:, None], surface.faces[:, ::-1], surface.faces)
        shells = [manifold_of(replace(surface, faces=faces))]
    shells = shells[0].decompose()
    for shell in shells:
        size = np.asarray(shell.bounding_box()).reshape(2, 3)
        if abs(shell.volume()) <= 1e-7 * float(np.prod(size[1] - size[0])):
            raise BadPart("has the volume zero (two sheets back to back?): give it a thickness")
    return _with_cavities(shells), int(turned.sum())


def _inward(surface: Surface, piece: np.ndarray) -> np.ndarray:
    """(p,) whether each piece has to be turned.

    A shell that no other encloses bounds material; the shells inside it are turned with it, so that a cavity
    stays a cavity for either winding of the file.
    """
    parts = [
        Surface(vertices=surface.vertices, faces=surface.faces[piece == i]) for i in range(piece.max() + 1)
    ]
    volumes = np.array([part.volume for part in parts])
    inward = volumes < 0
    if len(parts) > 1:
        around = _enclosing(parts, volumes)
        for index, outer in enumerate(around):
            if outer:
                outermost = max(outer, key=lambda i: abs(volumes[i]))
                inward[index] = volumes[outermost] < 0
    return inward


def _enclosing(parts: Sequence[Surface], volumes: np.ndarray) -> list[list[int]]:
    """Indices of the larger shells that enclose each shell."""
    low = np.array([part.triangles.min(axis=(0, 1)) for part in parts])
    high = np.array([part.triangles.max(axis=(0, 1)) for part in parts])
    result = []
    for index, part in enumerate(parts):
        boxes = (low <= low[index]).all(axis=1) & (high >= high[index]).all(axis=1)
        larger = np.flatnonzero(boxes & (np.abs(volumes) > abs(volumes[index])))
        point = part.triangles[0].mean(axis=0)
        result.append([int(i) for i in larger if abs(winding_number(parts[int(i)].triangles, point)) > 0.5])
    return result


def _with_cavities(shells: list[Manifold]) -> list[Manifold]:
    """Bodies with their cavities: each shell wound inwards belongs to the smallest body around it."""
    if len(shells) == 1:
        return shells
    surfaces = [surface_of(shell) for shell in shells]
    volumes = np.array([surface.volume for surface in surfaces])
    cavities = [int(index) for index in np.flatnonzero(volumes < 0)]
    if not cavities:
        return shells
    around = _enclosing(surfaces, volumes)
    held: dict[int, list[int]] = {int(index): [int(index)] for index in np.flatnonzero(volumes > 0)}
    for index in cavities:
        hosts = [i for i in around[index] if volumes[i] > 0]
        if not hosts:
            raise BadPart(
                "is not a proper solid: one of its shells is wound inwards and is inside no other; "
                "repair and export it again"
            )
        held[min(hosts, key=lambda i: volumes[i])].append(index)
    return [manifold_of(joined_surfaces([surfaces[i] for i in members])) for members in held.values()]


def _joined(solids: list[Manifold]) -> list[Manifold]:
    union = Manifold.batch_boolean(solids, OpType.Add)
    rest = _with_cavities(union.decompose())
    if len(rest) > 1:
        raise BadPart(
            f"has {count_of(len(rest), 'body')} that do not touch even when joined "
            f"({_volumes(sorted(rest, key=lambda solid: -solid.volume()))}): mskgrasp.parts import --split "
            "makes a part of each"
        )
    return rest


def _several(solids: list[Manifold]) -> str:
    return (
        f"has {len(solids)} separate bodies ({_volumes(solids)}): "
        "mskgrasp.parts import --split makes a part of each, --union joins those that touch or overlap"
    )


def _volumes(solids: list[Manifold]) -> str:
    shown = [f"{solid.volume() / 1000:.3g}" for solid in solids[:3]]
    return ", ".join(shown) + (", ..." if len(solids) > 3 else "") + " cm^3"


def _check_volume(surface: Surface) -> list[str]:
    share = miscounted_fraction(surface.triangles)
    if np.isnan(share):
        raise BadPart(f"is thinner than 1/{LINES} of its size everywhere: make it thicker")
    if share > MISCOUNTED:
        raise BadPart(
            f"crosses itself: {100 * min(share, 9.99):.1f} % of its volume would be counted twice or as "
            f"negative, the limit is {100 * MISCOUNTED} %; join its bodies in the CAD program, or repair it, "
            "for example with Blender's Remesh"
        )
    if share > 0:
        return [f"crosses itself in {100 * share:.1g} % of its volume (kept)"]
    return []
