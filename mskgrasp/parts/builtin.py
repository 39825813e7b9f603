"""Part building: from a recipe or a solid to a part folder, and from a name to a part."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import ConvexHull
from trimesh.exchange.gltf import export_glb
from trimesh.exchange.ply import export_ply

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.parts import store
from mskgrasp.parts.part import SCHEMA_VERSION, Part
from mskgrasp.parts.recipes import cad, families
from mskgrasp.parts.recipes.recipe import Recipe
from mskgrasp.parts.solids.measure import (
    MOST_ASPECT_RATIO,
    HullFit,
    aspect_ratio,
    hull_fit,
    longest_axis,
    mass_properties,
)
from mskgrasp.parts.solids.solid import MAX_HULL_VERTICES, Solid
from mskgrasp.parts.solids.stable_poses import stable_poses
from mskgrasp.parts.versions import PART_VERSION, stamp

MAX_HULL_FACES = 64
LEGAL_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}")
MANY_HULLS = 16
"""Above this number the time of a grasp grows with every hull, so that joining them pays off."""

MOST_P95_MM = 0.7
MOST_VOLUME_RATIO = 1.1


def builtin_names() -> tuple[str, ...]:
    """Names of all parts with a recipe, sorted: the families, and with ``[cad]`` those drawn in CAD."""
    return tuple(sorted(_recipes()))


def starter_names() -> tuple[str, ...]:
    """Names of the starter set, sorted: 25 parts of 17 families, built in a few seconds."""
    return families.STARTER


@lru_cache(maxsize=1)
def _recipes() -> dict[str, Recipe]:
    found = dict(families.recipes())
    if cad.available():
        for recipe in cad.recipes():
            if recipe.name in found:
                raise BadPart(f"two recipes are called {recipe.name!r}: rename one")
            found[recipe.name] = recipe
    return found


def recipe_of(name: str) -> Recipe:
    """The recipe of a built-in part.

    Raises:
        BadPart: There is no such part.
    """
    recipe = _recipes().get(name)
    if recipe is None:
        raise unknown_part(name, builtin_only=True)
    return recipe


def build_part(name: str) -> Part:
    """Builds a part from its recipe, unless the parts folder has it up to date.

    Raises:
        BadPart: There is no such recipe, or no set of hulls represents the shape closely enough.
    """
    recipe = recipe_of(name)
    if is_built(name):
        return store.read_part(store.parts_folder() / name)
    dimensions = {
        key.removesuffix("_mm"): value / 1000 if key.endswith("_mm") else value
        for key, value in recipe.dimensions.items()
    }
    return write_solid(
        with_hulls(recipe.make(recipe.dimensions)),
        name=name,
        family=recipe.family,
        source=recipe.source,
        licence=recipe.licence,
        density=recipe.density,
        dimensions=dimensions,
        recipe_hash=recipe_hash(name),
    )


def with_hulls(solid: Solid) -> Solid:
    """The solid with hulls: those of its family, joined where they are many, or those of a decomposition."""
    if solid.hulls and len(solid.hulls) <= MANY_HULLS:
        return solid
    # CoACD is slow to load, and most parts do not need it.
    from mskgrasp.parts.solids.decompose import convex_pieces, fewest_hulls

    mesh = trimesh.Trimesh(np.array(solid.mesh.vertices), solid.mesh.faces, process=False)
    hulls = fewest_hulls(mesh, solid.hulls) if solid.hulls else convex_pieces(mesh)
    return Solid(mesh=solid.mesh, hulls=tuple(hulls))


def is_built(name: str) -> bool:
    """Whether the parts folder has a part, undamaged and built by the current recipe."""
    return store.recipe_hash(store.parts_folder() / name) == recipe_hash(name)


def find_part(name_or_folder: str | Path) -> Part:
    """A part by its name or by its folder; a built-in one is built where it is missing.

    Raises:
        UnknownPart: There is no such part; the message lists similar names.
        BadPart: Its folder is damaged, or it cannot be built.
    """
    text = str(name_or_folder)
    if text in _recipes():
        return build_part(text)
    if LEGAL_NAME.fullmatch(text) and (store.parts_folder() / text).is_dir():
        return store.read_part(store.parts_folder() / text)
    if Path(text).is_dir():
        return store.read_part(Path(text))
    raise unknown_part(text)


def imported_names() -> tuple[str, ...]:
    """Names of the parts in the parts folder that are not built in, sorted."""
    root = store.parts_folder()
    found = (path.name for path in root.iterdir() if path.is_dir()) if root.is_dir() else ()
    builtin = _recipes()
    return tuple(sorted(name for name in found if LEGAL_NAME.fullmatch(name) and name not in builtin))


def unknown_part(name: str, *, builtin_only: bool = False) -> UnknownPart:
    """The error for a name that no part has."""
    known = builtin_names() if builtin_only else (*builtin_names(), *imported_names())
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    hint = f"did you mean {', '.join(close)}?" if close else "`python -m mskgrasp.parts list` shows the parts"
    kind = "built-in part" if builtin_only else "part or part folder"
    return UnknownPart(f"no {kind} is called {name!r}: {hint}")


def write_solid(
    solid: Solid,
    *,
    name: str,
    family: str,
    source: str,
    licence: str,
    density: float,
    dimensions: dict[str, float],
    recipe_hash: str,
) -> Part:
    """Measures a solid, moves its centroid to the origin and stores it as a part."""
    masses = mass_properties(solid.mesh, density)
    centroid_mm = masses.centroid * 1000
    mesh = trimesh.Trimesh(solid.mesh.vertices - centroid_mm, solid.mesh.faces, process=False)
    # Rounded to the precision of the file, so that everything measured below holds for the stored hulls.
    hulls = [_corners((points - centroid_mm).astype(np.float32)) for points in solid.hulls]
    for number, points in enumerate(hulls):
        _check_hull(name, number, points)
    fit = hull_fit(mesh, hulls)
    _check_fit(name, fit)
    resting, probability = stable_poses(np.concatenate(hulls).astype(np.float64))
    record: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "name": name,
        "family": family,
        "source": source,
        "licence": licence,
        "dimensions": dimensions,
        "density": density,
        "volume": masses.volume,
        "mass": masses.mass,
        "centroid_in_source": masses.centroid,
        "inertia": masses.inertia,
        "principal_inertia": masses.principal_inertia,
        "quat_obj_principal": masses.quat_principal,
        "extents": mesh.extents / 1000,
        "longest_axis": longest_axis(mesh) / 1000,
        "n_hulls": len(hulls),
        "hulls_volume": 1e-9 * sum(ConvexHull(points.astype(np.float64)).volume for points in hulls),
        "hull_error": fit.largest / 1000,
        "hull_error_p95": fit.p95 / 1000,
        "hull_volume_ratio": fit.volume_ratio,
        "hull_outward": {"largest": fit.outward_largest / 1000, "p95": fit.outward_p95 / 1000},
        "hull_inward": {"largest": fit.inward_largest / 1000, "p95": fit.inward_p95 / 1000},
        "resting": {"position": resting.position, "quat_wxyz": resting.quat_wxyz},
        "resting_probability": probability,
        "recipe_hash": recipe_hash,
    }
    return store.write_part(
        name, _ply(mesh), _glb(hulls), {key: _plain(value) for key, value in record.items()}
    )


def recipe_hash(name: str) -> str:
    """Digest of everything that determines a part: versions, dimensions, vendors' libraries."""
    recipe = recipe_of(name)
    module = recipe.make.__module__
    text = [
        SCHEMA_VERSION,
        stamp("part", PART_VERSION),
        stamp(".".join(module.split(".")[-2:]), recipe.version),
        cad.versions() if module.startswith(cad.__name__) else "",
        recipe.name,
        recipe.family,
        recipe.source,
        recipe.licence,
        recipe.density,
        recipe.dimensions,
    ]
    return hashlib.sha256(json.dumps(text, sort_keys=True).encode()).hexdigest()


def _corners(points: np.ndarray) -> np.ndarray:
    """The points that are corners of their convex hull."""
    return points[np.sort(ConvexHull(points.astype(np.float64)).vertices)]


def _check_fit(name: str, fit: HullFit) -> None:
    """Refuses hulls that deviate too far from the mesh: contacts would be those of another shape."""
    least = 1 / MOST_VOLUME_RATIO
    if fit.p95 > MOST_P95_MM or not least <= fit.volume_ratio <= MOST_VOLUME_RATIO:
        raise BadPart(
            f"{name}: the hulls deviate from the mesh: 95 % of the surface is within {fit.p95:.2f} mm (at "
            f"most {MOST_P95_MM} mm), volume ratio {fit.volume_ratio:.2f} ({least:.2f} to "
            f"{MOST_VOLUME_RATIO}): simplify fine detail such as threads, grilles and thin walls"
        )


def _check_hull(name: str, number: int, points: np.ndarray) -> None:
    faces = len(ConvexHull(points.astype(np.float64)).simplices)
    if len(points) > MAX_HULL_VERTICES or faces > MAX_HULL_FACES:
        raise BadPart(
            f"{name}: hull {number} has {len(points)} vertices and {faces} faces, "
            f"the limits are {MAX_HULL_VERTICES} and {MAX_HULL_FACES}: split it"
        )
    ratio = aspect_ratio(points.astype(np.float64))
    if ratio > MOST_ASPECT_RATIO:
        raise BadPart(
            f"{name}: hull {number} is {ratio:.0f} times longer than thick, PhysX accepts up to "
            f"{MOST_ASPECT_RATIO:.0f}: make the part thicker or shorter"
        )


def _ply(mesh_mm: trimesh.Trimesh) -> bytes:
    mesh = trimesh.Trimesh(mesh_mm.vertices / 1000, mesh_mm.faces, process=False)
    return export_ply(mesh, encoding="binary", vertex_normal=False)


def _glb(hulls_mm: list[np.ndarray]) -> bytes:
    """One node per hull. SAPIEN uses the coordinates of a GLB as they are: no rotation to y-up."""
    scene = trimesh.Scene()
    for number, points in enumerate(hulls_mm):
        hull = trimesh.convex.convex_hull(points.astype(np.float64))
        scene.add_geometry(hull, node_name=f"hull_{number:02d}", geom_name=f"hull_{number:02d}")
    return export_glb(scene, include_normals=False)


def _plain(value: Any) -> Any:
    """JSON types, floats to 9 significant digits so that rounding noise is not stored."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{float(value):.9g}") + 0.0
    if isinstance(value, (int, np.integer)):
        return int(value)
    return value
